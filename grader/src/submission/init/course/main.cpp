// Reads a scene, takes its steps and writes its trace: called as `simulate SCENE TRACE`. Nothing is to be done here.
//
// PIECE protocol_xml.txt

#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

INCLUDES

PIECE elements.cpp

std::unique_ptr<SceneStepper> stepperOf(const std::string& type) {
STEPPERS
    notImplemented(type.c_str());
}

// The length of the path through these particles at the start.
inline scalar pathLength(const VectorXs& x, const std::vector<int>& particles) {
    scalar length = 0;
    for (std::size_t n = 1; n < particles.size(); ++n)
        length += std::hypot(x[2 * particles[n]] - x[2 * particles[n - 1]], x[2 * particles[n] + 1] - x[2 * particles[n - 1] + 1]);
    return length;
}

int simulate(const std::string& scene_file, const std::string& trace_file) {
    if (scene_file.size() < 4 || scene_file.substr(scene_file.size() - 4) != ".xml") notImplemented("this format of scenes");
    const std::vector<Element> elements = elements_of(scene_file);

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

    std::ofstream trace(trace_file);
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

PIECE main.cpp
