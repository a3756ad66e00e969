#include "signed_incidence_matrix_dense.h"
#include "not_implemented.h"

void signed_incidence_matrix_dense(const int n, const Eigen::MatrixXi& E, Eigen::MatrixXd& A) {
    not_implemented("signed_incidence_matrix_dense");
}
