#include "signed_incidence_matrix_sparse.h"

#include <vector>

void signed_incidence_matrix_sparse(const int n, const Eigen::MatrixXi& E, Eigen::SparseMatrix<double>& A) {
    std::vector<Eigen::Triplet<double>> entries;
    for (int e = 0; e < E.rows(); ++e) entries.emplace_back(e, E(e, 0), 1), entries.emplace_back(e, E(e, 1), -1);
    A.resize(E.rows(), n);
    A.setFromTriplets(entries.begin(), entries.end());
}
