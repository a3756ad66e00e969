#include "fast_mass_springs_precomputation_sparse.h"
#include "not_implemented.h"

bool fast_mass_springs_precomputation_sparse(const Eigen::MatrixXd& V, const Eigen::MatrixXi& E, const double k, const Eigen::VectorXd& m,
    const Eigen::VectorXi& b, const double delta_t, Eigen::VectorXd& r, Eigen::SparseMatrix<double>& M, Eigen::SparseMatrix<double>& A,
    Eigen::SparseMatrix<double>& C, Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>& prefactorization) {
    not_implemented("fast_mass_springs_precomputation_sparse");
}
