#include "signed_incidence_matrix_sparse.h"
#include "not_implemented.h"

void signed_incidence_matrix_sparse(const int n, const Eigen::MatrixXi& E, Eigen::SparseMatrix<double>& A) {
    not_implemented("signed_incidence_matrix_sparse");
}
