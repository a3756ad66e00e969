// A: a row a spring, a column a particle; +1 at E(e, 0), -1 at E(e, 1).
#pragma once
#include <Eigen/Dense>
#include <Eigen/Sparse>

void signed_incidence_matrix_sparse(const int n, const Eigen::MatrixXi& E, Eigen::SparseMatrix<double>& A);
