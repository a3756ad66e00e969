#pragma once
// Vectors, matrices, and the end of a run that needs what is not there yet.

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

using scalar = double;
using VectorXs = std::vector<scalar>;  // x0 y0 x1 y1 ...

// A square matrix of zeros.
struct MatrixXs {
    explicit MatrixXs(std::size_t size) : size(size), entries(size * size, 0.0) {}

    scalar& operator()(std::size_t row, std::size_t column) { return entries[row * size + column]; }

    std::size_t size;
    std::vector<scalar> entries;
};

// The solution of A u = b, by elimination with row pivoting.
inline VectorXs solve(MatrixXs A, VectorXs b) {
    for (std::size_t k = 0; k < A.size; ++k) {
        std::size_t pivot = k;
        for (std::size_t row = k + 1; row < A.size; ++row)
            if (std::abs(A(row, k)) > std::abs(A(pivot, k))) pivot = row;
        for (std::size_t column = k; column < A.size; ++column) std::swap(A(k, column), A(pivot, column));
        std::swap(b[k], b[pivot]);
        for (std::size_t row = k + 1; row < A.size; ++row) {
            const scalar factor = A(row, k) / A(k, k);
            if (factor == 0) continue;
            for (std::size_t column = k; column < A.size; ++column) A(row, column) -= factor * A(k, column);
            b[row] -= factor * b[k];
        }
    }
    for (std::size_t k = A.size; k-- > 0;) {
        for (std::size_t column = k + 1; column < A.size; ++column) b[k] -= A(k, column) * b[column];
        b[k] /= A(k, k);
    }
    return b;
}

PIECE not_implemented.cpp
