#include "fast_mass_springs_step_dense.h"

void fast_mass_springs_step_dense(const Eigen::MatrixXd& V, const Eigen::MatrixXi& E, const double k, const Eigen::VectorXi& b,
    const double delta_t, const Eigen::MatrixXd& fext, const Eigen::VectorXd& r, const Eigen::MatrixXd& M,
    const Eigen::MatrixXd& A, const Eigen::MatrixXd& C, const Eigen::LLT<Eigen::MatrixXd>& prefactorization,
    const Eigen::MatrixXd& Uprev, const Eigen::MatrixXd& Ucur, Eigen::MatrixXd& Unext) {
    const Eigen::MatrixXd fixed =
        M * (2 * Ucur - Uprev) / (delta_t * delta_t) + fext + 1e10 * C.transpose() * (C * V);
    Unext = Ucur;
    for (int round = 0; round < 50; ++round) {
        const Eigen::MatrixXd d = r.asDiagonal() * (A * Unext).rowwise().normalized();
        Unext = prefactorization.solve(k * A.transpose() * d + fixed);
    }
}
