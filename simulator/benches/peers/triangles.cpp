// The peer with Eigen: triangles of St. Venant and Kirchhoff's material on the square sheet of `simulate generate sheet`, by
// linearized implicit Euler and by symplectic Euler.
//
//     F = (x2 - x1 | x3 - x1) B    S = mu (FtF - I) + lambda/2 tr(FtF - I) I    force on a: -A F S w_a    q_a = F w_a
//     Hessian (a, b) = A ((w_a . S w_b) I + mu (w_a . w_b) F Ft + mu q_b q_at + lambda q_a q_bt)
//
// The pattern is analysed once, and the blocks of each triangle are added where they stand in the matrix. Built with
// WITH_CHOLMOD, CHOLMOD's supernodal Cholesky takes the place of Eigen's LDLT.
//
// build: g++ -O3 -march=native -DNDEBUG $(pkg-config --cflags eigen3) triangles.cpp -o triangles
// build with CHOLMOD: g++ -O3 -march=native -DNDEBUG -DWITH_CHOLMOD $(pkg-config --cflags eigen3) -I/usr/include/suitesparse triangles.cpp -o triangles-cholmod -lcholmod
// usage: triangles lie|symplectic SEGMENTS TIME_STEP STEPS MODULUS
#include <Eigen/Dense>
#include <Eigen/Sparse>
#ifdef WITH_CHOLMOD
#include <Eigen/CholmodSupport>
#endif

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;
#ifdef WITH_CHOLMOD
using Solver = Eigen::CholmodSupernodalLLT<Sparse>;
#else
using Solver = Eigen::SimplicialLDLT<Sparse>;
#endif

namespace {

constexpr double kPoissonRatio = 0.3, kDensity = 1000.0, kStretch = 1.1;

double seconds() {
    using namespace std::chrono;
    return duration<double>(steady_clock::now().time_since_epoch()).count();
}

struct Triangle {
    std::array<int, 3> corners;
    Matrix2d inverse;
    double area;
    /// Of each block on and below the diagonal: the values of its two columns. Null above.
    std::array<std::array<double*, 2>, 9> blocks;
};

/// The unit square with mass 1000, stretched along x.
struct Sheet {
    VectorXd x, mass;
    std::vector<Triangle> triangles;
    double mu, lambda;

    Sheet(int n, double modulus)
        : x(2 * (n + 1) * (n + 1)),
          mass(VectorXd::Zero(x.size())),
          mu(modulus / (2 * (1 + kPoissonRatio))),
          lambda(modulus * kPoissonRatio / (1 - kPoissonRatio * kPoissonRatio)) {
        for (int row = 0; row <= n; ++row)
            for (int column = 0; column <= n; ++column)
                x.segment<2>(2 * (row * (n + 1) + column)) << double(column) / n, double(row) / n;
        for (int row = 0; row < n; ++row)
            for (int column = 0; column < n; ++column) {
                const int a = row * (n + 1) + column, b = a + 1, c = a + n + 1, d = c + 1;
                if ((row + column) % 2 == 0) {
                    add({a, b, d});
                    add({a, d, c});
                } else {
                    add({a, b, c});
                    add({b, d, c});
                }
            }
        for (int particle = 0; particle < x.size() / 2; ++particle) x(2 * particle) *= kStretch;
    }

    void add(std::array<int, 3> corners) {
        Triangle triangle{corners, sides(x, corners), 0, {}};
        triangle.area = 0.5 * triangle.inverse.determinant();
        triangle.inverse = triangle.inverse.inverse().eval();
        for (int corner : corners) mass.segment<2>(2 * corner).array() += kDensity * triangle.area / 3;
        triangles.push_back(triangle);
    }

    static Matrix2d sides(const VectorXd& x, const std::array<int, 3>& corners) {
        const Vector2d origin = x.segment<2>(2 * corners[0]);
        Matrix2d sides;
        sides << x.segment<2>(2 * corners[1]) - origin, x.segment<2>(2 * corners[2]) - origin;
        return sides;
    }

    Matrix2d stress(const Matrix2d& f) const {
        const Matrix2d twice = f.transpose() * f - Matrix2d::Identity();
        return mu * twice + 0.5 * lambda * twice.trace() * Matrix2d::Identity();
    }

    void force(const VectorXd& x, VectorXd& force) const {
        force.setZero();
        for (const Triangle& triangle : triangles) {
            const Matrix2d f = sides(x, triangle.corners) * triangle.inverse;
            add_force(triangle, f, stress(f), force);
        }
    }

    static void add_force(const Triangle& triangle, const Matrix2d& f, const Matrix2d& stress, VectorXd& force) {
        const Matrix2d pull = triangle.area * f * stress * triangle.inverse.transpose();
        force.segment<2>(2 * triangle.corners[0]) += pull.col(0) + pull.col(1);
        force.segment<2>(2 * triangle.corners[1]) -= pull.col(0);
        force.segment<2>(2 * triangle.corners[2]) -= pull.col(1);
    }

    /// The lower triangle of a matrix with a block for each two particles of a triangle; tells each triangle where its are.
    Sparse pattern() {
        std::vector<Eigen::Triplet<double>> entries;
        const auto each = [&](auto&& visit) {
            for (Triangle& triangle : triangles)
                for (int a = 0; a < 3; ++a)
                    for (int b = 0; b < 3; ++b)
                        if (triangle.corners[a] >= triangle.corners[b])
                            visit(triangle, 3 * a + b, 2 * triangle.corners[a], 2 * triangle.corners[b]);
        };
        each([&](Triangle&, int, int row, int column) {
            for (int i = 0; i < 2; ++i)
                for (int j = 0; j < 2; ++j) entries.emplace_back(row + i, column + j, 1.0);
        });
        Sparse matrix(x.size(), x.size());
        matrix.setFromTriplets(entries.begin(), entries.end());
        each([&](Triangle& triangle, int block, int row, int column) {
            triangle.blocks[block] = {&matrix.coeffRef(row, column), &matrix.coeffRef(row, column + 1)};
        });
        return matrix;
    }

    /// Adds the force, and `scale` times the Hessian to the matrix.
    void add(const VectorXd& x, double scale, VectorXd& force) const {
        for (const Triangle& triangle : triangles) {
            const Matrix2d f = sides(x, triangle.corners) * triangle.inverse, s = stress(f);
            add_force(triangle, f, s, force);
            const Matrix2d ff = f * f.transpose();
            Eigen::Matrix<double, 3, 2> w;
            w << -triangle.inverse.colwise().sum(), triangle.inverse;
            const Eigen::Matrix<double, 2, 3> q = f * w.transpose();
            for (int a = 0; a < 3; ++a)
                for (int b = 0; b < 3; ++b) {
                    if (!triangle.blocks[3 * a + b][0]) continue;
                    const Matrix2d block = scale * triangle.area *
                                           ((w.row(a) * s * w.row(b).transpose()).value() * Matrix2d::Identity() +
                                            mu * w.row(a).dot(w.row(b)) * ff + mu * q.col(b) * q.col(a).transpose() +
                                            lambda * q.col(a) * q.col(b).transpose());
                    for (int column = 0; column < 2; ++column)
                        for (int row = 0; row < 2; ++row) triangle.blocks[3 * a + b][column][row] += block(row, column);
                }
        }
    }
};

double implicit(Sheet& sheet, double h, int steps) {
    Sparse matrix = sheet.pattern();
    const int size = static_cast<int>(sheet.x.size());
    Solver solver;
    VectorXd v = VectorXd::Zero(size), force(size);
    const double start = seconds();
    for (int step = 0; step < steps; ++step) {
        std::fill(matrix.valuePtr(), matrix.valuePtr() + matrix.nonZeros(), 0.0);
        force.setZero();
        sheet.add(sheet.x + h * v, h * h, force);
        for (int row = 0; row < size; ++row) *(matrix.valuePtr() + matrix.outerIndexPtr()[row] + row % 2) += sheet.mass(row);
        if (step == 0) solver.analyzePattern(matrix);
        solver.factorize(matrix);
        if (solver.info() != Eigen::Success) {
            std::fprintf(stderr, "error: the matrix of step %d has no factor\n", step + 1);
            std::exit(1);
        }
        v += solver.solve(h * force);
        sheet.x += h * v;
    }
    return seconds() - start;
}

double symplectic(Sheet& sheet, double h, int steps) {
    VectorXd v = VectorXd::Zero(sheet.x.size()), force(sheet.x.size());
    const VectorXd scale = h * sheet.mass.cwiseInverse();
    const double start = seconds();
    for (int step = 0; step < steps; ++step) {
        sheet.force(sheet.x, force);
        v += scale.cwiseProduct(force);
        sheet.x += h * v;
    }
    return seconds() - start;
}

}  // namespace

int main(int count, char** arguments) {
    if (count < 6) {
        std::fprintf(stderr, "error: usage: triangles lie|symplectic SEGMENTS TIME_STEP STEPS MODULUS\n");
        return 2;
    }
    Sheet sheet(std::atoi(arguments[2]), std::atof(arguments[5]));
    const double h = std::atof(arguments[3]);
    const int steps = std::atoi(arguments[4]);
    const bool is_implicit = !std::strcmp(arguments[1], "lie");
    const double time = is_implicit ? implicit(sheet, h, steps) : symplectic(sheet, h, steps);
    std::printf("triangles=%zu ns_per_step=%.6g x0=%.15g\n", sheet.triangles.size(), time / steps * 1e9, sheet.x(0));
    return 0;
}
