// The peer with CHOLMOD: linearized implicit Euler by supernodal Cholesky factorisations, and fast mass-spring with
// one such factor, on the square net of `simulate generate net`. Both find their dense kernels in the BLAS that the
// system has chosen.
//
// A matrix that a compressed spring makes indefinite has no Cholesky factor. Such a step takes CHOLMOD's simplicial
// LDLᵀ in its place, and is counted.
//
// build: g++ -O3 -march=native -DNDEBUG cholmod.cpp -o cholmod -lcholmod -ldl
// usage: cholmod lie|fms SEGMENTS TIME_STEP STEPS STIFFNESS [ITERATIONS], or cholmod version
#include <suitesparse/cholmod.h>

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

namespace {

struct Spring {
    int i, j;
    double rest_length;
};

/// The unit square with mass 1000, stretched by 1.4 along x.
struct Net {
    std::vector<double> x;
    std::vector<Spring> springs;
    double mass;

    explicit Net(int segments) : mass(1000.0 / ((segments + 1) * (segments + 1))) {
        const auto at = [&](int row, int column) { return row * (segments + 1) + column; };
        for (int row = 0; row <= segments; ++row)
            for (int column = 0; column <= segments; ++column) {
                x.push_back(-0.5 + row * (1.0 / segments));
                x.push_back(-0.5 + column * (1.0 / segments));
            }
        const auto join = [&](int i, int j) {
            springs.push_back({i, j, std::hypot(x[2 * i] - x[2 * j], x[2 * i + 1] - x[2 * j + 1])});
        };
        for (int row = 0; row < segments; ++row)
            for (int column = 0; column <= segments; ++column)
                join(at(row, column), at(row + 1, column));
        for (int row = 0; row <= segments; ++row)
            for (int column = 0; column < segments; ++column)
                join(at(row, column), at(row, column + 1));
        for (int row = 0; row < segments; ++row)
            for (int column = 0; column < segments; ++column) {
                join(at(row, column), at(row + 1, column + 1));
                join(at(row + 1, column), at(row, column + 1));
            }
        for (std::size_t particle = 0; particle < x.size() / 2; ++particle) x[2 * particle] *= 1.4;
    }
};

double seconds() {
    using namespace std::chrono;
    return duration<double>(steady_clock::now().time_since_epoch()).count();
}

/// The lower triangle of a symmetric matrix of `width` × `width` blocks, one for each particle and each spring.
class Matrix {
public:
    Matrix(const Net& net, int width, cholmod_common* common) : width_(width) {
        const int particles = static_cast<int>(net.x.size()) / 2;
        std::vector<std::map<int, std::vector<int>>> columns(particles);
        for (int particle = 0; particle < particles; ++particle) columns[particle][particle];
        for (const Spring& spring : net.springs)
            columns[std::min(spring.i, spring.j)][std::max(spring.i, spring.j)];
        const std::size_t n = static_cast<std::size_t>(particles) * width;
        std::size_t entries = 0;
        for (const auto& column : columns) entries += column.size() * width * width;
        // Entries above the diagonal of diagonal blocks are kept, and ignored.
        sparse = cholmod_allocate_sparse(n, n, entries, 1, 1, -1, CHOLMOD_REAL, common);
        int* starts = static_cast<int*>(sparse->p);
        int* rows = static_cast<int*>(sparse->i);
        values_ = static_cast<double*>(sparse->x);
        int entry = 0;
        std::map<std::pair<int, int>, int> places;
        for (int particle = 0; particle < particles; ++particle)
            for (int axis = 0; axis < width; ++axis) {
                starts[particle * width + axis] = entry;
                for (const auto& [row, unused] : columns[particle]) {
                    if (axis == 0) places[{row, particle}] = entry;
                    for (int of_row = 0; of_row < width; ++of_row) rows[entry++] = row * width + of_row;
                }
            }
        starts[n] = entry;
        for (int particle = 0; particle < particles; ++particle) {
            strides_.push_back(static_cast<int>(columns[particle].size()) * width);
            diagonal_.push_back(places[{particle, particle}]);
        }
        for (const Spring& spring : net.springs) {
            const int column = std::min(spring.i, spring.j);
            off_diagonal_.push_back({places[{std::max(spring.i, spring.j), column}], strides_[column]});
        }
    }

    void set_diagonal(double value) {
        std::fill(values_, values_ + sparse->nzmax, 0.0);
        for (std::size_t particle = 0; particle < diagonal_.size(); ++particle)
            for (int axis = 0; axis < width_; ++axis)
                values_[diagonal_[particle] + axis * (strides_[particle] + 1)] += value;
    }

    /// Adds a symmetric block to the diagonal blocks of a spring's particles, and its negative to that of both.
    void add(std::size_t number, const Spring& spring, const double* block) {
        const auto [place, stride] = off_diagonal_[number];
        for (int column = 0; column < width_; ++column)
            for (int row = 0; row < width_; ++row) {
                const double value = block[column * width_ + row];
                values_[diagonal_[spring.i] + column * strides_[spring.i] + row] += value;
                values_[diagonal_[spring.j] + column * strides_[spring.j] + row] += value;
                values_[place + column * stride + row] -= value;
            }
    }

    cholmod_sparse* sparse;

private:
    int width_;
    double* values_;
    /// Entries of a column of each particle; its diagonal block; the block of each spring with its stride.
    std::vector<int> strides_, diagonal_;
    std::vector<std::array<int, 2>> off_diagonal_;
};

cholmod_factor* analyse(cholmod_sparse* matrix, bool supernodal, cholmod_common* common) {
    common->supernodal = supernodal ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL;
    common->final_ll = supernodal;
    return cholmod_analyze(matrix, common);
}

/// The printed results of a run.
struct Result {
    /// Seconds of all steps.
    double time = 0;
    /// The first coordinate at the end.
    double x0 = 0;
    /// Matrices without a Cholesky factor.
    int refused = 0;
    /// The shortest factorisation in seconds, and its operations.
    double of_factor = INFINITY, operations = 0;
};

/// A factor's solutions, in memory that is kept.
class Solver {
public:
    Solver(std::size_t rows, std::size_t columns, cholmod_common* common)
        : right_(cholmod_zeros(rows, columns, CHOLMOD_REAL, common)), common_(common) {}

    double* right() { return static_cast<double*>(right_->x); }

    const double* solve(cholmod_factor* factor) {
        cholmod_solve2(CHOLMOD_A, factor, right_, nullptr, &solution_, nullptr, &y_, &e_, common_);
        return static_cast<double*>(solution_->x);
    }

private:
    cholmod_dense *right_, *solution_ = nullptr, *y_ = nullptr, *e_ = nullptr;
    cholmod_common* common_;
};

Result linearized_implicit_euler(Net net, double h, int steps, double k, cholmod_common* common) {
    const std::size_t size = net.x.size();
    Matrix matrix(net, 2, common);
    Solver solver(size, 1, common);
    cholmod_factor *factor = nullptr, *indefinite = nullptr;
    double* impulse = solver.right();
    std::vector<double> v(size, 0.0), y(size);
    Result result;
    const double start = seconds();
    for (int step = 0; step < steps; ++step) {
        for (std::size_t c = 0; c < size; ++c) y[c] = net.x[c] + h * v[c];
        std::fill(impulse, impulse + size, 0.0);
        matrix.set_diagonal(net.mass);
        for (std::size_t number = 0; number < net.springs.size(); ++number) {
            const auto [i, j, rest_length] = net.springs[number];
            const double dx = y[2 * i] - y[2 * j], dy = y[2 * i + 1] - y[2 * j + 1];
            const double length = std::sqrt(dx * dx + dy * dy), nx = dx / length, ny = dy / length;
            const double pull = h * k * (length - rest_length), strain = (length - rest_length) / length;
            impulse[2 * i] -= pull * nx;
            impulse[2 * i + 1] -= pull * ny;
            impulse[2 * j] += pull * nx;
            impulse[2 * j + 1] += pull * ny;
            const double scale = h * h * k, across = scale * (1 - strain) * nx * ny;
            const double block[4] = {scale * (nx * nx + strain * (1 - nx * nx)), across, across,
                                     scale * (ny * ny + strain * (1 - ny * ny))};
            matrix.add(number, net.springs[number], block);
        }
        if (!factor) factor = analyse(matrix.sparse, true, common);
        const double before = seconds();
        cholmod_factorize(matrix.sparse, factor, common);
        cholmod_factor* used = factor;
        if (common->status != CHOLMOD_NOT_POSDEF) {
            result.of_factor = std::min(result.of_factor, seconds() - before);
            result.operations = common->fl;
        } else {
            ++result.refused;
            if (!indefinite) indefinite = analyse(matrix.sparse, false, common);
            cholmod_factorize(matrix.sparse, indefinite, common);
            used = indefinite;
        }
        const double* change = solver.solve(used);
        for (std::size_t c = 0; c < size; ++c) {
            v[c] += change[c];
            net.x[c] += h * v[c];
        }
    }
    result.time = seconds() - start;
    result.x0 = net.x[0];
    return result;
}

Result fast_mass_spring(const Net& net, double h, int steps, double k, int iterations, cholmod_common* common) {
    const std::size_t size = net.x.size(), particles = size / 2;
    // Both coordinates have one matrix, with a number for each pair of particles.
    Matrix matrix(net, 1, common);
    const double weight = net.mass / (h * h), block[1] = {k};
    matrix.set_diagonal(weight);
    for (std::size_t number = 0; number < net.springs.size(); ++number)
        matrix.add(number, net.springs[number], block);
    cholmod_factor* factor = analyse(matrix.sparse, true, common);
    cholmod_factorize(matrix.sparse, factor, common);
    Solver solver(particles, 2, common);
    // Coordinates one after the other, as the right-hand sides are.
    std::vector<double> x(size), before, inertia(size);
    for (std::size_t particle = 0; particle < particles; ++particle)
        for (int axis = 0; axis < 2; ++axis) x[axis * particles + particle] = net.x[2 * particle + axis];
    before = x;
    Result result;
    const double start = seconds();
    for (int step = 0; step < steps; ++step) {
        for (std::size_t c = 0; c < size; ++c) inertia[c] = weight * (2 * x[c] - before[c]);
        before = x;
        for (int iteration = 0; iteration < iterations; ++iteration) {
            double* b = solver.right();
            std::copy(inertia.begin(), inertia.end(), b);
            for (const auto& [i, j, rest_length] : net.springs) {
                const double dx = x[i] - x[j], dy = x[particles + i] - x[particles + j];
                const double scale = k * rest_length / std::sqrt(dx * dx + dy * dy);
                b[i] += scale * dx;
                b[j] -= scale * dx;
                b[particles + i] += scale * dy;
                b[particles + j] -= scale * dy;
            }
            const double* solved = solver.solve(factor);
            std::copy(solved, solved + size, x.begin());
        }
    }
    result.time = seconds() - start;
    result.x0 = x[0];
    return result;
}

/// The name of the BLAS, where it tells one.
const char* blas() {
    using Tell = char* (*)();
    const auto tell = reinterpret_cast<Tell>(dlsym(RTLD_DEFAULT, "openblas_get_config"));
    return tell ? tell() : "a BLAS without a name";
}

}  // namespace

int main(int count, char** arguments) {
    cholmod_common common;
    cholmod_start(&common);
    common.print = 0;
    if (count > 1 && !std::strcmp(arguments[1], "version")) {
        std::printf("CHOLMOD %d.%d.%d · %s\n", CHOLMOD_MAIN_VERSION, CHOLMOD_SUB_VERSION, CHOLMOD_SUBSUB_VERSION,
                    blas());
        return 0;
    }
    if (count < 6) {
        std::fprintf(stderr, "error: usage: cholmod lie|fms SEGMENTS TIME_STEP STEPS STIFFNESS [ITERATIONS]\n");
        return 2;
    }
    const bool is_lie = !std::strcmp(arguments[1], "lie");
    const double h = std::atof(arguments[3]), k = std::atof(arguments[5]);
    const int steps = std::atoi(arguments[4]), iterations = count > 6 ? std::atoi(arguments[6]) : 50;
    const Net net(std::atoi(arguments[2]));
    const Result result = is_lie ? linearized_implicit_euler(net, h, steps, k, &common)
                                 : fast_mass_spring(net, h, steps, k, iterations, &common);
    const double a_step = result.time / steps;
    std::printf(
        "springs=%zu ms_per_step=%.4f ns_per_spring_step=%.3f x0=%.15g refused=%d factor_ms=%.4f factor_flops=%.6g\n",
        net.springs.size(), a_step * 1e3, a_step / net.springs.size() * 1e9, result.x0, result.refused,
        result.of_factor * 1e3, result.operations);
    return 0;
}
