// A mass-spring simulator: called as `simulate SCENE TRACE`, it turns a scene into a trace.
//
// The protocol
//   SCENE  XML. <duration time="..."/> and <integrator type="..." dt="..."/> set duration, method and step; each
//          <particle m px py vx vy fixed/> is a particle, numbered from 0. Forces are further elements;
//          springs refer to <edge i j/> by its number. Elements come in any order; ignore unknown ones.
//   TRACE  CSV: a header `step,time,x0,y0,vx0,vy0,x1,...`, then one row for each state. The first row is the initial
//          state, and ceil(duration / dt) rows follow. Write all digits: precision 17 does.
//   Exit with status 0 on success, and with 77 for a scene that you do not support. Your standard error
//   is shown in the report of a failed run. Read no other file, and write to the working directory only;
//   there is no network.

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

struct Element {
    std::string name;
    std::map<std::string, std::string> attributes;

    double number(const std::string& attribute) const {
        const auto found = attributes.find(attribute);
        if (found == attributes.end()) {
            std::cerr << "<" << name << "> has no " << attribute << "\n";
            std::exit(1);
        }
        return std::strtod(found->second.c_str(), nullptr);
    }
};

// The elements of a scene, in the order of the file: as much XML as scenes need.
std::vector<Element> read_elements(const std::string& path) {
    std::ifstream file(path);
    std::stringstream buffer;
    buffer << file.rdbuf();
    const std::string text = buffer.str();
    std::vector<Element> elements;
    std::size_t at = 0;
    while ((at = text.find('<', at)) != std::string::npos) {
        if (text.compare(at, 4, "<!--") == 0) {
            at = text.find("-->", at);
            continue;
        }
        const std::size_t end = text.find('>', at);
        std::size_t next = text.find_first_of(" \t\r\n/>", at + 1);
        Element element{text.substr(at + 1, next - at - 1), {}};
        while (next < end) {
            const std::size_t name = text.find_first_not_of(" \t\r\n/", next);
            const std::size_t open = text.find_first_of("\"'", name);
            if (name >= end || open >= end) break;
            const std::size_t close = text.find(text[open], open + 1);
            const std::size_t name_end = text.find_first_of(" \t\r\n=", name);
            element.attributes[text.substr(name, name_end - name)] =
                text.substr(open + 1, close - open - 1);
            next = close + 1;
        }
        elements.push_back(element);
        at = end;
    }
    return elements;
}

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
    for (const Element& element : read_elements(path)) {
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

int main(int count, char** arguments) {
    if (count != 3) {
        std::cerr << "called as: simulate SCENE TRACE\n";
        return 2;
    }
    Scene scene = read_scene(arguments[1]);
    std::ofstream trace(arguments[2]);
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
