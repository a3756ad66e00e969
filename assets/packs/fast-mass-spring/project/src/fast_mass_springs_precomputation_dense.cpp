#include "fast_mass_springs_precomputation_dense.h"
#include "not_implemented.h"

bool fast_mass_springs_precomputation_dense(const Eigen::MatrixXd& V, const Eigen::MatrixXi& E, const double k, const Eigen::VectorXd& m,
    const Eigen::VectorXi& b, const double delta_t, Eigen::VectorXd& r, Eigen::MatrixXd& M, Eigen::MatrixXd& A,
    Eigen::MatrixXd& C, Eigen::LLT<Eigen::MatrixXd>& prefactorization) {
    not_implemented("fast_mass_springs_precomputation_dense");
}
