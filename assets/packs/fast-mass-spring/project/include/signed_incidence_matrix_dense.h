// A: a row a spring, a column a particle; +1 at E(e, 0), -1 at E(e, 1).
#pragma once
#include <Eigen/Dense>

void signed_incidence_matrix_dense(const int n, const Eigen::MatrixXi& E, Eigen::MatrixXd& A);
