// driver dense|sparse SCENE TRACE    takes the steps of a scene
// driver --calls CALLS ANSWERS       calls functions, one in each line

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "fast_mass_springs_precomputation_dense.h"
#include "fast_mass_springs_precomputation_sparse.h"
#include "fast_mass_springs_step_dense.h"
#include "fast_mass_springs_step_sparse.h"
#include "not_implemented.h"
#include "signed_incidence_matrix_dense.h"
#include "signed_incidence_matrix_sparse.h"

using Eigen::MatrixXd;
using Eigen::MatrixXi;
using Eigen::VectorXd;
using Eigen::VectorXi;

void not_implemented(const char* name) {
    std::fprintf(stderr, "%s is not implemented\n", name);
    std::exit(77);
}

// The functions with dense and with sparse matrices.
struct Dense {
    using Matrix = MatrixXd;
    using Factor = Eigen::LLT<MatrixXd>;
    static constexpr auto incidence = signed_incidence_matrix_dense;
    static constexpr auto precompute = fast_mass_springs_precomputation_dense;
    static constexpr auto step = fast_mass_springs_step_dense;
    static Matrix matrix(const MatrixXd& full) { return full; }
    static MatrixXd product(const Factor& factor) { return factor.reconstructedMatrix(); }
};

struct Sparse {
    using Matrix = Eigen::SparseMatrix<double>;
    using Factor = Eigen::SimplicialLLT<Matrix>;
    static constexpr auto incidence = signed_incidence_matrix_sparse;
    static constexpr auto precompute = fast_mass_springs_precomputation_sparse;
    static constexpr auto step = fast_mass_springs_step_sparse;
    static Matrix matrix(const MatrixXd& full) { return full.sparseView(); }
    static MatrixXd product(const Factor& factor) {
        const MatrixXd lower = Matrix(factor.matrixL());
        return factor.permutationPinv() * (lower * lower.transpose()) * factor.permutationP();
    }
};

struct Net {
    MatrixXd V;
    MatrixXi E;
    VectorXd m;
    VectorXi b;
    double k, h;
};

template <class Kind>
struct Precomputed {
    VectorXd r;
    typename Kind::Matrix M, A, C;
    typename Kind::Factor factor;
    explicit Precomputed(const Net& net) {
        if (!Kind::precompute(net.V, net.E, net.k, net.m, net.b, net.h, r, M, A, C, factor)) {
            std::fprintf(stderr, "the factorisation failed\n");
            std::exit(1);
        }
    }
};

// Numbers of a call, in order.
struct Numbers {
    std::istringstream& words;
    double next() {
        std::string word;
        words >> word;
        return std::strtod(word.c_str(), nullptr);
    }
    MatrixXd matrix(int rows, int columns) {
        MatrixXd all(rows, columns);
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < columns; ++j) all(i, j) = next();
        return all;
    }
};

template <class Kind>
static MatrixXd call(const std::string& name, Numbers numbers) {
    const int n = numbers.next(), springs = numbers.next(), pins = numbers.next();
    Net net;
    net.k = numbers.next();
    net.h = numbers.next();
    net.V = numbers.matrix(n, 3);
    net.E = numbers.matrix(springs, 2).cast<int>();
    net.m = numbers.matrix(n, 1);
    net.b = numbers.matrix(pins, 1).cast<int>();
    if (name == "A") {
        typename Kind::Matrix A;
        Kind::incidence(n, net.E, A);
        return A;
    }
    if (name == "step" || name == "round") {
        const MatrixXd forces = numbers.matrix(n, 3), before = numbers.matrix(n, 3), now = numbers.matrix(n, 3);
        const auto A = Kind::matrix(numbers.matrix(springs, n)), M = Kind::matrix(numbers.matrix(n, n));
        const auto C = Kind::matrix(numbers.matrix(pins, n));
        const VectorXd r = numbers.matrix(springs, 1);
        const typename Kind::Factor factor(Kind::matrix(numbers.matrix(n, n)));
        MatrixXd next = now;
        Kind::step(net.V, net.E, net.k, net.b, net.h, forces, r, M, A, C, factor, before, now, next);
        return next;
    }
    const Precomputed<Kind> all(net);
    if (name == "r") return all.r;
    return name == "M" ? MatrixXd(all.M) : name == "C" ? MatrixXd(all.C) : Kind::product(all.factor);
}

static void answer(const char* path, const char* target) {
    std::ifstream calls(path);
    std::FILE* answers = std::fopen(target, "w");
    for (std::string line, name; std::getline(calls, line);) {
        std::istringstream words(line);
        words >> name;
        const auto dash = name.find('-');
        const MatrixXd all = dash == std::string::npos ? call<Dense>(name, {words}) : call<Sparse>(name.substr(0, dash), {words});
        for (int i = 0; i < all.rows(); ++i)
            for (int j = 0; j < all.cols(); ++j) std::fprintf(answers, "%.17g ", all(i, j));
        std::fprintf(answers, "\n");
    }
    std::fclose(answers);
}

static std::string read_file(const std::string& path) {
    std::ifstream file(path);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

static std::string value_of(const std::string& json, const std::string& key) {
    const std::size_t name = json.find('"' + key + '"');
    if (name == std::string::npos) return "";
    const std::size_t start = json.find_first_not_of(" \t\r\n", json.find(':', name) + 1);
    const std::size_t end = json[start] == '[' ? json.find(']', start) : json.find_first_of(",}", start);
    return json.substr(start, end - start);
}

// Mixed Voronoi areas of a triangle's corners.
static void add_areas(const MatrixXd& V, const int (&corner)[3], VectorXd& m) {
    double squared[3], opposite[3];
    for (int c = 0; c < 3; ++c) squared[c] = (V.row(corner[(c + 1) % 3]) - V.row(corner[(c + 2) % 3])).squaredNorm();
    const Eigen::Vector3d u = V.row(corner[1]) - V.row(corner[0]), w = V.row(corner[2]) - V.row(corner[0]);
    const double area = u.cross(w).norm() / 2;
    int obtuse = -1;
    for (int c = 0; c < 3; ++c) {
        opposite[c] = squared[(c + 1) % 3] + squared[(c + 2) % 3] - squared[c];
        if (opposite[c] < 0) obtuse = c;
    }
    for (int c = 0; c < 3; ++c) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        m[corner[c]] += obtuse < 0 ? (squared[d] * opposite[d] + squared[e] * opposite[e]) / (32 * area) : area / (obtuse == c ? 2 : 4);
    }
}

static Net read_scene(const char* path) {
    const std::string json = read_file(path), mesh = value_of(json, "obj");
    if (value_of(json, "wind").rfind("true", 0) == 0) not_implemented("wind");
    std::string pins = value_of(json, "b");
    for (char& character : pins)
        if (character == '[' || character == ',') character = ' ';
    std::vector<int> pinned;
    std::istringstream list(pins);
    for (int vertex; list >> vertex;) pinned.push_back(vertex - 1);
    std::vector<double> points;
    std::vector<int> ends;
    std::vector<std::vector<int>> faces;
    std::set<std::pair<int, int>> known;
    std::istringstream lines(read_file(mesh.substr(1, mesh.rfind('"') - 1)));
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string kind, corner;
        words >> kind;
        if (kind == "v") {
            double x, y, z;
            words >> x >> y >> z;
            points.insert(points.end(), {x, y, z});
        } else if (kind == "f") {
            std::vector<int> face;
            while (words >> corner) face.push_back(std::atoi(corner.c_str()) - 1);
            for (std::size_t a = 0; a < face.size(); ++a)
                for (std::size_t b = a + 1; b < face.size(); ++b)
                    if (known.insert(std::minmax(face[a], face[b])).second) ends.push_back(face[a]), ends.push_back(face[b]);
            faces.push_back(face);
        }
    }
    Net net;
    net.h = 1.0 / 30;
    net.k = std::atof(value_of(json, "k").c_str());
    net.V = Eigen::Map<Eigen::Matrix<double, -1, 3, Eigen::RowMajor>>(points.data(), points.size() / 3, 3);
    net.E = Eigen::Map<Eigen::Matrix<int, -1, 2, Eigen::RowMajor>>(ends.data(), ends.size() / 2, 2);
    net.b = Eigen::Map<VectorXi>(pinned.data(), pinned.size());
    net.m = VectorXd::Constant(net.V.rows(), std::atof(value_of(json, "m").c_str()));
    if (value_of(json, "m").empty())
        for (const auto& face : faces)
            for (std::size_t c = 2; c < face.size(); ++c) add_areas(net.V, {face[0], face[c - 1], face[c]}, net.m);
    return net;
}

template <class Kind>
static void simulate(const Net& net, const char* target) {
    const Precomputed<Kind> all(net);
    MatrixXd forces = MatrixXd::Zero(net.V.rows(), 3), before = net.V, now = net.V, next = net.V;
    forces.col(1).setConstant(-9.8);
    std::FILE* trace = std::fopen(target, "w");
    std::fprintf(trace, "step,time");
    for (int i = 0; i < net.V.rows(); ++i) std::fprintf(trace, ",x%d,y%d,z%d", i, i, i);
    for (int number = 0; number <= 30; ++number) {
        if (number > 0) {
            Kind::step(net.V, net.E, net.k, net.b, net.h, forces, all.r, all.M, all.A, all.C, all.factor, before, now, next);
            before = now;
            now = next;
        }
        std::fprintf(trace, "\n%d,%.17g", number, number * net.h);
        for (int i = 0; i < now.rows(); ++i) std::fprintf(trace, ",%.17g,%.17g,%.17g", now(i, 0), now(i, 1), now(i, 2));
    }
    std::fprintf(trace, "\n");
    std::fclose(trace);
}

int main(int, char** argv) {
    const std::string first = argv[1];
    if (first == "--calls")
        answer(argv[2], argv[3]);
    else if (first == "dense")
        simulate<Dense>(read_scene(argv[2]), argv[3]);
    else
        simulate<Sparse>(read_scene(argv[2]), argv[3]);
}
