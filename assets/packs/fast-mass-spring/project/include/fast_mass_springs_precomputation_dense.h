// Lengths r, masses M, incidence A, pins C, and the factor of k A'A + M / delta_t^2 + w C'C, of particles V, springs E, masses m and
// pinned particles b. Whether the factor exists.
#pragma once
#include <Eigen/Dense>

bool fast_mass_springs_precomputation_dense(const Eigen::MatrixXd& V, const Eigen::MatrixXi& E, const double k, const Eigen::VectorXd& m,
    const Eigen::VectorXi& b, const double delta_t, Eigen::VectorXd& r, Eigen::MatrixXd& M, Eigen::MatrixXd& A,
    Eigen::MatrixXd& C, Eigen::LLT<Eigen::MatrixXd>& prefactorization);
