#include "fast_mass_springs_precomputation_sparse.h"

#include <vector>

#include "signed_incidence_matrix_sparse.h"

bool fast_mass_springs_precomputation_sparse(const Eigen::MatrixXd& V, const Eigen::MatrixXi& E, const double k, const Eigen::VectorXd& m,
    const Eigen::VectorXi& b, const double delta_t, Eigen::VectorXd& r, Eigen::SparseMatrix<double>& M, Eigen::SparseMatrix<double>& A,
    Eigen::SparseMatrix<double>& C, Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>& prefactorization) {
    signed_incidence_matrix_sparse(V.rows(), E, A);
    r = (A * V).rowwise().norm();
    std::vector<Eigen::Triplet<double>> masses, pins;
    for (int i = 0; i < m.size(); ++i) masses.emplace_back(i, i, m[i]);
    for (int i = 0; i < b.size(); ++i) pins.emplace_back(i, b[i], 1);
    M.resize(V.rows(), V.rows());
    M.setFromTriplets(masses.begin(), masses.end());
    C.resize(b.size(), V.rows());
    C.setFromTriplets(pins.begin(), pins.end());
    const Eigen::SparseMatrix<double> Q = k * A.transpose() * A + M / (delta_t * delta_t) + 1e10 * C.transpose() * C;
    prefactorization.compute(Q);
    return prefactorization.info() == Eigen::Success;
}
