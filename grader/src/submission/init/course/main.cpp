// Reads a scene, takes its steps and writes its trace: called as `simulate SCENE TRACE`. Nothing is to be done here.
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

#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

INCLUDES

struct Element {
    std::string name;
    std::map<std::string, std::string> attributes;

    scalar number(const std::string& attribute) const {
        const auto found = attributes.find(attribute);
        if (found == attributes.end()) {
            std::cerr << "<" << name << "> has no " << attribute << "\n";
            std::exit(1);
        }
        return std::strtod(found->second.c_str(), nullptr);
    }

    scalar number(const std::string& attribute, scalar otherwise) const {
        return attributes.count(attribute) > 0 ? number(attribute) : otherwise;
    }
};

// The elements of a scene, in the order of the file: as much XML as scenes need.
std::vector<Element> readElements(const std::string& path) {
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
            const std::size_t nameEnd = text.find_first_of(" \t\r\n=", name);
            element.attributes[text.substr(name, nameEnd - name)] = text.substr(open + 1, close - open - 1);
            next = close + 1;
        }
        elements.push_back(element);
        at = end;
    }
    return elements;
}

std::unique_ptr<SceneStepper> stepperOf(const std::string& type) {
STEPPERS
    notImplemented(type.c_str());
}

int main(int count, char** arguments) {
    if (count != 3) {
        std::cerr << "called as: simulate SCENE TRACE\n";
        return 2;
    }
    const std::string path = arguments[1];
    if (path.size() < 4 || path.substr(path.size() - 4) != ".xml") notImplemented("this format of scenes");
    const std::vector<Element> elements = readElements(path);

    TwoDScene scene;
    scalar duration = 0, dt = 0;
    std::string type;
    std::vector<std::pair<int, int>> edges;
    for (const Element& element : elements) {
        for (const char* axis : {"pz", "vz", "fz"})
            if (element.attributes.count(axis) > 0) notImplemented("a scene in three dimensions");
        if (element.name == "duration") {
            duration = element.number("time");
        } else if (element.name == "integrator") {
            type = element.attributes.at("type");
            dt = element.number("dt");
        } else if (element.name == "particle") {
            scene.insertParticle(element.number("m"), element.number("px"), element.number("py"),
                                 element.number("vx"), element.number("vy"), element.number("fixed") != 0);
        } else if (element.name == "edge") {
            edges.push_back({static_cast<int>(element.number("i")), static_cast<int>(element.number("j"))});
        }
    }
    for (const Element& element : elements) {
FORCES
    }
    const std::unique_ptr<SceneStepper> stepper = stepperOf(type);

    std::ofstream trace(arguments[2]);
    trace.precision(17);
    trace << "step,time";
    for (int i = 0; i < scene.getNumParticles(); ++i) trace << ",x" << i << ",y" << i << ",vx" << i << ",vy" << i;
    trace << "\n";
    const long steps = static_cast<long>(std::ceil(duration / dt));
    for (long step = 0; step <= steps; ++step) {
        if (step > 0 && !stepper->stepScene(scene, dt)) return 1;
        trace << step << "," << step * dt;
        for (int i = 0; i < scene.getNumParticles(); ++i) {
            const VectorXs &x = scene.getX(), &v = scene.getV();
            trace << "," << x[2 * i] << "," << x[2 * i + 1] << "," << v[2 * i] << "," << v[2 * i + 1];
        }
        trace << "\n";
    }
    return trace.good() ? 0 : 1;
}
