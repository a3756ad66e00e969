// A fast mass-spring simulator: called as `simulate SCENE TRACE SOLVER`, it turns a scene into a trace.
//
// The protocol
//   SCENE   JSON beside an OBJ file: {"obj": "net.obj", "k": 300, "m": 1, "b": [1, 5], "wind": false}. k is the stiffness
//           of every spring, m the mass of every vertex (without it, a vertex weighs the area around it), b the pinned
//           vertices, counted from 1. Each pair of vertices of a face is a spring, once; its rest length is that of the
//           OBJ file. The vertices start there, at rest.
//   TRACE   CSV: a header `step,time,x0,y0,z0,x1,...`, then one row for each state: the initial one, then 30 steps of
//           1/30 s. Write all digits: precision 17 does. Velocities are not needed.
//   SOLVER  dense or sparse: which of the two implementations is graded.
//   Exit with status 0 on success. Your standard error is shown in the report of a failed run. Read no
//   other file, and write to the working directory only; there is no network.

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

using Vector = std::array<double, 3>;

const double time_step = 1.0 / 30;
const int steps = 30;
const Vector external_force = {0, -9.8, 0};  // on each vertex, not scaled by its mass

struct Scene {
    double stiffness = 0;
    double mass = 0;  // 0: not given
    bool wind = false;
    std::vector<Vector> rest, x, previous;
    std::vector<std::pair<int, int>> springs;  // vertices from 0
    std::vector<int> pinned;                   // from 0
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
            Vector vertex;
            words >> vertex[0] >> vertex[1] >> vertex[2];
            scene.rest.push_back(vertex);
        } else if (kind == "f") {
            std::vector<int> face;
            while (words >> corner) face.push_back(std::atoi(corner.c_str()) - 1);  // 3/1 is vertex 3
            for (std::size_t a = 0; a < face.size(); ++a)
                for (std::size_t b = a + 1; b < face.size(); ++b)
                    if (known.insert(std::minmax({face[a], face[b]})).second)
                        scene.springs.push_back({face[a], face[b]});
        }
    }
    scene.x = scene.previous = scene.rest;
    return scene;
}

// What does not change from step to step. To do: signed incidence matrix, masses, Q and its factorisation.
void precompute(Scene& scene, bool is_dense) {
    (void)scene;
    (void)is_dense;
}

// One step. To do: 50 rounds of the local step (a vector d for each spring) and the global step (Q p = b).
void step(Scene& scene) {
    scene.previous = scene.x;
}

int main(int count, char** arguments) {
    if (count != 4) {
        std::cerr << "called as: simulate SCENE TRACE SOLVER\n";
        return 2;
    }
    Scene scene = read_scene(arguments[1]);
    precompute(scene, std::string(arguments[3]) == "dense");
    std::ofstream trace(arguments[2]);
    trace.precision(17);
    trace << "step,time";
    for (std::size_t i = 0; i < scene.x.size(); ++i)
        trace << ",x" << i << ",y" << i << ",z" << i;
    trace << "\n";
    for (int number = 0; number <= steps; ++number) {
        if (number > 0) step(scene);
        trace << number << "," << number * time_step;
        for (const Vector& x : scene.x) trace << "," << x[0] << "," << x[1] << "," << x[2];
        trace << "\n";
    }
    return trace.good() ? 0 : 1;
}
