#include "fast_mass_springs_step_dense.h"
#include "not_implemented.h"

void fast_mass_springs_step_dense(const Eigen::MatrixXd& V, const Eigen::MatrixXi& E, const double k, const Eigen::VectorXi& b,
    const double delta_t, const Eigen::MatrixXd& fext, const Eigen::VectorXd& r, const Eigen::MatrixXd& M,
    const Eigen::MatrixXd& A, const Eigen::MatrixXd& C, const Eigen::LLT<Eigen::MatrixXd>& prefactorization,
    const Eigen::MatrixXd& Uprev, const Eigen::MatrixXd& Ucur, Eigen::MatrixXd& Unext) {
    not_implemented("fast_mass_springs_step_dense");
}
