#include "fast_mass_springs_precomputation_dense.h"

#include <vector>

#include "signed_incidence_matrix_dense.h"

bool fast_mass_springs_precomputation_dense(const Eigen::MatrixXd& V, const Eigen::MatrixXi& E, const double k, const Eigen::VectorXd& m,
    const Eigen::VectorXi& b, const double delta_t, Eigen::VectorXd& r, Eigen::MatrixXd& M, Eigen::MatrixXd& A,
    Eigen::MatrixXd& C, Eigen::LLT<Eigen::MatrixXd>& prefactorization) {
    signed_incidence_matrix_dense(V.rows(), E, A);
    r = (A * V).rowwise().norm();
    M = m.asDiagonal();
    C = Eigen::MatrixXd::Zero(b.size(), V.rows());
    for (int i = 0; i < b.size(); ++i) C(i, b[i]) = 1;
    const Eigen::MatrixXd Q = k * A.transpose() * A + M / (delta_t * delta_t) + 1e10 * C.transpose() * C;
    prefactorization.compute(Q);
    return prefactorization.info() == Eigen::Success;
}
