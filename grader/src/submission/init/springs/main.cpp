// Reads a scene, takes its steps and writes its trace: called as `simulate SCENE TRACE SOLVER`. Complete but for the
// wind, which is extra credit.
//
// PIECE protocol_json.txt

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "fast_mass_springs.h"

const double time_step = 1.0 / 30;
const int steps = 30;

struct Scene {
    double stiffness = 0;
    double mass = 0;  // 0: not given
    bool wind = false;
    Points rest;
    Edges springs;                       // vertices from 0
    std::vector<std::vector<int>> faces;  // vertices from 0
    std::vector<int> pinned;             // from 0
    std::vector<double> masses;
};

std::string read_file(const std::string& path) {
    std::ifstream file(path);
    if (!file) {
        std::cerr << path << " cannot be read\n";
        std::exit(1);
    }
    std::stringstream buffer;
    buffer << file.rdbuf();
    return buffer.str();
}

// The text of a key's value: as much JSON as scenes need. Empty if there is no such key.
std::string value_of(const std::string& json, const std::string& key) {
    const std::size_t name = json.find("\"" + key + "\"");
    if (name == std::string::npos) return "";
    const std::size_t start = json.find_first_not_of(" \t\r\n", json.find(':', name) + 1);
    const std::size_t end = json[start] == '[' ? json.find(']', start) : json.find_first_of(",}", start);
    return json.substr(start, end - start);
}

// The mixed Voronoi area of each vertex. A face of more than three corners counts as the triangles around its first.
std::vector<double> voronoi_areas(const Scene& scene) {
    std::vector<double> areas(scene.rest.size(), 0.0);
    for (const auto& face : scene.faces)
        for (std::size_t last = 2; last < face.size(); ++last) {
            const int corners[3] = {face[0], face[last - 1], face[last]};
            double squares[3];  // of the side opposite to each corner
            for (int c = 0; c < 3; ++c) {
                const auto &a = scene.rest[corners[(c + 1) % 3]], &b = scene.rest[corners[(c + 2) % 3]];
                squares[c] = std::pow(a[0] - b[0], 2) + std::pow(a[1] - b[1], 2) + std::pow(a[2] - b[2], 2);
            }
            // 16 area² by Heron's formula in the squares of the sides.
            const double sum = squares[0] + squares[1] + squares[2];
            const double area =
                std::sqrt(std::max(sum * sum - 2 * (squares[0] * squares[0] + squares[1] * squares[1] +
                                                    squares[2] * squares[2]), 0.0)) / 4;
            double cotangents[3];
            int obtuse = -1;
            for (int c = 0; c < 3; ++c) {
                cotangents[c] = (sum - 2 * squares[c]) / (4 * area);
                if (cotangents[c] < 0) obtuse = c;
            }
            for (int c = 0; c < 3; ++c) {
                const int next = (c + 1) % 3, third = (c + 2) % 3;
                const double shares = squares[next] * cotangents[next] + squares[third] * cotangents[third];
                areas[corners[c]] += obtuse < 0 ? shares / 8 : area / (obtuse == c ? 2 : 4);
            }
        }
    return areas;
}

Scene read_scene(const std::string& path) {
    const std::string json = read_file(path);
    Scene scene;
    scene.stiffness = std::atof(value_of(json, "k").c_str());
    scene.mass = std::atof(value_of(json, "m").c_str());
    scene.wind = value_of(json, "wind").rfind("true", 0) == 0;
    std::string pins = value_of(json, "b");
    for (char& character : pins)
        if (character == '[' || character == ',') character = ' ';
    std::istringstream list(pins);
    for (int vertex; list >> vertex;) scene.pinned.push_back(vertex - 1);

    std::string mesh = value_of(json, "obj");
    mesh = mesh.substr(1, mesh.rfind('"') - 1);
    std::istringstream lines(read_file(mesh));
    std::set<std::pair<int, int>> known;
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string kind, corner;
        words >> kind;
        if (kind == "v") {
            std::array<double, 3> vertex;
            words >> vertex[0] >> vertex[1] >> vertex[2];
            scene.rest.push_back(vertex);
        } else if (kind == "f") {
            std::vector<int> face;
            while (words >> corner) face.push_back(std::atoi(corner.c_str()) - 1);  // 3/1 is vertex 3
            for (std::size_t a = 0; a < face.size(); ++a)
                for (std::size_t b = a + 1; b < face.size(); ++b)
                    if (known.insert(std::minmax({face[a], face[b]})).second)
                        scene.springs.push_back({face[a], face[b]});
            scene.faces.push_back(face);
        }
    }
    scene.masses = scene.mass > 0 ? std::vector<double>(scene.rest.size(), scene.mass) : voronoi_areas(scene);
    return scene;
}

// The data that one of the two solvers keeps from step to step.
template <typename Matrix>
struct Precomputed {
    std::vector<double> r;
    Matrix M, A, C, prefactorization;
};

int main(int count, char** arguments) {
    if (count != 4) {
        std::cerr << "called as: simulate SCENE TRACE SOLVER\n";
        return 2;
    }
    const Scene scene = read_scene(arguments[1]);
    const bool is_dense = std::string(arguments[3]) == "dense";
    const auto& [V, E, b, m, k] = std::tie(scene.rest, scene.springs, scene.pinned, scene.masses, scene.stiffness);
    Precomputed<DenseMatrix> dense;
    Precomputed<SparseMatrix> sparse;
    const bool is_ready =
        is_dense ? fast_mass_springs_precomputation_dense(
                       V, E, k, m, b, time_step, dense.r, dense.M, dense.A, dense.C, dense.prefactorization)
                 : fast_mass_springs_precomputation_sparse(
                       V, E, k, m, b, time_step, sparse.r, sparse.M, sparse.A, sparse.C, sparse.prefactorization);
    if (!is_ready) {
        std::cerr << "the precomputation failed\n";
        return 1;
    }
    // On each vertex, not scaled by its mass.
    const Points fext(V.size(), {0, -9.8, 0});
    // Your code here: to the external force of each step, wind adds (3 + 1.5 (1 + cos 5p), 1 + cos(0.3 + p), sin p) on each
    // vertex, with p = x/d + t of its current x and the current time, and d the diagonal of the box around V.
    if (scene.wind) notImplemented("windforce");

    Points previous = V, current = V, next = V;
    std::ofstream trace(arguments[2]);
    trace.precision(17);
    trace << "step,time";
    for (std::size_t i = 0; i < V.size(); ++i) trace << ",x" << i << ",y" << i << ",z" << i;
    trace << "\n";
    for (int number = 0; number <= steps; ++number) {
        if (number > 0) {
            if (is_dense) {
                fast_mass_springs_step_dense(V, E, k, b, time_step, fext, dense.r, dense.M, dense.A, dense.C,
                                             dense.prefactorization, previous, current, next);
            } else {
                fast_mass_springs_step_sparse(V, E, k, b, time_step, fext, sparse.r, sparse.M, sparse.A, sparse.C,
                                              sparse.prefactorization, previous, current, next);
            }
            previous = current;
            current = next;
        }
        trace << number << "," << number * time_step;
        for (const auto& x : current) trace << "," << x[0] << "," << x[1] << "," << x[2];
        trace << "\n";
    }
    return trace.good() ? 0 : 1;
}
