// A mass-spring simulator: called as `simulate SCENE TRACE`, it turns a scene into a trace.
//
// PIECE protocol_xml.txt

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

PIECE elements.cpp

struct Scene {
    double duration = 0, dt = 0;
    std::string method;
    std::vector<double> mass;
    std::vector<bool> fixed;
    std::vector<double> x, v;  // x0 y0 x1 y1 ...
};

Scene read_scene(const std::string& path) {
    Scene scene;
    if (path.size() < 4 || path.substr(path.size() - 4) != ".xml") std::exit(77);
    for (const Element& element : elements_of(path)) {
        for (const char* axis : {"pz", "vz", "fz"}) {
            if (element.attributes.count(axis) > 0) std::exit(77);  // three dimensions
        }
        if (element.name == "duration") {
            scene.duration = element.number("time");
        } else if (element.name == "integrator") {
            scene.method = element.attributes.at("type");
            scene.dt = element.number("dt");
        } else if (element.name == "particle") {
            scene.mass.push_back(element.number("m"));
            scene.fixed.push_back(element.number("fixed") != 0);
            for (const char* axis : {"x", "y"}) {
                scene.x.push_back(element.number(std::string("p") + axis));
                scene.v.push_back(element.number(std::string("v") + axis));
            }
        }
        // To do: ELEMENTS.
    }
    return scene;
}

// The force on each particle at the current state, laid out as x is.
std::vector<double> forces(const Scene& scene) {
    std::vector<double> total(scene.x.size(), 0.0);
    // To do: add FORCES.
    return total;
}

// Explicit Euler: positions with the old velocities, velocities with the forces of the old state.
void step(Scene& scene) {
    // To do: METHODS.
    const std::vector<double> force = forces(scene);
    for (std::size_t k = 0; k < scene.x.size(); ++k) {
        // A fixed particle keeps its velocity, and moves by it.
        scene.x[k] += scene.dt * scene.v[k];
        if (!scene.fixed[k / 2]) scene.v[k] += scene.dt * force[k] / scene.mass[k / 2];
    }
}

int simulate(const std::string& scene_file, const std::string& trace_file) {
    Scene scene = read_scene(scene_file);
    std::ofstream trace(trace_file);
    trace.precision(17);
    trace << "step,time";
    for (std::size_t i = 0; i < scene.mass.size(); ++i) {
        trace << ",x" << i << ",y" << i << ",vx" << i << ",vy" << i;
    }
    trace << "\n";
    const long steps = static_cast<long>(std::ceil(scene.duration / scene.dt));
    for (long number = 0; number <= steps; ++number) {
        if (number > 0) step(scene);
        trace << number << "," << number * scene.dt;
        for (std::size_t i = 0; i < scene.mass.size(); ++i) {
            trace << "," << scene.x[2 * i] << "," << scene.x[2 * i + 1];
            trace << "," << scene.v[2 * i] << "," << scene.v[2 * i + 1];
        }
        trace << "\n";
    }
    return trace.good() ? 0 : 1;
}

PIECE main.cpp
