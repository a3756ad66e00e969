#pragma once
// The six functions of the assignment, and what they work on.
//
//   V   rest positions        E   springs, as pairs of vertices from 0        r   rest lengths
//   k   stiffness             b   pinned vertices, from 0                      m   masses of the vertices
//   A   signed incidence matrix (springs by vertices)    M   masses    C   selection of the pinned vertices

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

using Points = std::vector<std::array<double, 3>>;
using Edges = std::vector<std::pair<int, int>>;

struct DenseMatrix {
    DenseMatrix() = default;
    DenseMatrix(int rows, int columns) : rows(rows), columns(columns), entries(std::size_t(rows) * columns, 0.0) {}

    double& operator()(int row, int column) { return entries[std::size_t(row) * columns + column]; }
    double operator()(int row, int column) const { return entries[std::size_t(row) * columns + column]; }

    int rows = 0, columns = 0;
    std::vector<double> entries;
};

// Entries that are not listed are zero.
struct SparseMatrix {
    struct Triplet {
        int row, column;
        double value;
    };

    int rows = 0, columns = 0;
    std::vector<Triplet> triplets;
};

void signed_incidence_matrix_dense(int n, const Edges& E, DenseMatrix& A);
void signed_incidence_matrix_sparse(int n, const Edges& E, SparseMatrix& A);

// Data that stay the same in all steps; prefactorization is a factor of Q, in whatever form you write it. The weight of
// pinned vertices in Q is w = 1e10. False if it fails.
bool fast_mass_springs_precomputation_dense(
    const Points& V, const Edges& E, double k, const std::vector<double>& m, const std::vector<int>& b, double delta_t,
    std::vector<double>& r, DenseMatrix& M, DenseMatrix& A, DenseMatrix& C, DenseMatrix& prefactorization);
bool fast_mass_springs_precomputation_sparse(
    const Points& V, const Edges& E, double k, const std::vector<double>& m, const std::vector<int>& b, double delta_t,
    std::vector<double>& r, SparseMatrix& M, SparseMatrix& A, SparseMatrix& C, SparseMatrix& prefactorization);

// One step, from the positions Uprev and Ucur to Unext; fext is the external force on each vertex. 50 rounds, which start
// from Ucur.
void fast_mass_springs_step_dense(
    const Points& V, const Edges& E, double k, const std::vector<int>& b, double delta_t, const Points& fext,
    const std::vector<double>& r, const DenseMatrix& M, const DenseMatrix& A, const DenseMatrix& C,
    const DenseMatrix& prefactorization, const Points& Uprev, const Points& Ucur, Points& Unext);
void fast_mass_springs_step_sparse(
    const Points& V, const Edges& E, double k, const std::vector<int>& b, double delta_t, const Points& fext,
    const std::vector<double>& r, const SparseMatrix& M, const SparseMatrix& A, const SparseMatrix& C,
    const SparseMatrix& prefactorization, const Points& Uprev, const Points& Ucur, Points& Unext);

PIECE not_implemented.cpp
