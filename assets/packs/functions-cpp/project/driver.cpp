// driver SCENE TRACE              takes the steps of a scene with the functions of forces.cpp
// driver --calls CALLS ANSWERS    calls the functions, one in each line

#include "forces.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

using Element = std::map<std::string, std::string>;

void not_implemented(const char* name) {
    std::fprintf(stderr, "%s is not implemented\n", name);
    std::exit(77);
}

static double get(const Element& e, const char* name) {
    const auto found = e.find(name);
    return found == e.end() ? 0.0 : std::strtod(found->second.c_str(), nullptr);
}

// A line of calls: the function, the dimension, masses, positions and velocities of the particles, parameters. A line of answers: the
// force on each particle.
static void answer(const char* path, const char* target) {
    std::ifstream calls(path);
    std::FILE* answers = std::fopen(target, "w");
    for (std::string line; std::getline(calls, line);) {
        std::istringstream words(line);
        std::string name;
        words >> name;
        std::vector<double> a;
        for (double value; words >> value;) a.push_back(value);
        if (name == "gravity" || name == "drag") {
            const Vec f = name == "drag" ? drag({a[4], a[5]}, a[6]) : simple_gravity(a[1], {a[6], a[7]});
            std::fprintf(answers, "%.17g %.17g\n", f.x, f.y);
        } else {
            const Vec xi{a[3], a[4]}, xj{a[5], a[6]}, vi{a[7], a[8]}, vj{a[9], a[10]};
            const Vec f = name == "spring" ? spring(xi, xj, vi, vj, a[11], a[12], a[13]) : gravitation(xi, xj, a[1], a[2], a[11]);
            std::fprintf(answers, "%.17g %.17g %.17g %.17g\n", f.x, f.y, -f.x, -f.y);
        }
    }
    std::fclose(answers);
}

int main(int, char** argv) {
    if (std::string(argv[1]) == "--calls") return answer(argv[2], argv[3]), 0;
    std::ifstream file(argv[1]);
    std::string text((std::istreambuf_iterator<char>(file)), {});
    for (std::size_t start; (start = text.find("<!--")) != std::string::npos;)
        text.erase(start, text.find("-->", start) + 3 - start);
    std::map<std::string, std::vector<Element>> all;
    const std::regex element(R"re(<(\w+)([^<>]*)>)re"), attribute(R"re((\w+)\s*=\s*["']([^"']*)["'])re");
    for (std::sregex_iterator e(text.begin(), text.end(), element), end; e != end; ++e) {
        const std::string rest = (*e)[2];
        Element attributes;
        for (std::sregex_iterator a(rest.begin(), rest.end(), attribute); a != end; ++a) attributes[(*a)[1]] = (*a)[2];
        all[(*e)[1]].push_back(attributes);
    }
    const auto& particles = all["particle"];
    std::vector<double> m;
    std::vector<Vec> x, v;
    for (const auto& p : particles) {
        m.push_back(get(p, "m"));
        x.push_back({get(p, "px"), get(p, "py")});
        v.push_back({get(p, "vx"), get(p, "vy")});
    }
    const Element integrator = all["integrator"].at(0);
    const double dt = get(integrator, "dt"), duration = get(all["duration"].at(0), "time");
    const bool is_explicit = integrator.at("type") == "explicit-euler";
    std::FILE* trace = std::fopen(argv[2], "w");
    std::fprintf(trace, "step,time");
    for (std::size_t i = 0; i < m.size(); ++i) std::fprintf(trace, ",x%zu,y%zu,vx%zu,vy%zu", i, i, i, i);
    for (int step = 0; step <= std::ceil(duration / dt); ++step) {
        if (step > 0) {
            std::vector<Vec> f(m.size(), Vec{0, 0});
            const auto add = [&](std::size_t i, Vec force, double sign) { f[i].x += sign * force.x, f[i].y += sign * force.y; };
            for (std::size_t i = 0; i < m.size(); ++i) {
                for (const auto& e : all["simplegravity"]) add(i, simple_gravity(m[i], {get(e, "fx"), get(e, "fy")}), 1);
                for (const auto& e : all["dragdamping"]) add(i, drag(v[i], get(e, "b")), 1);
            }
            const auto add_pair = [&](std::size_t i, std::size_t j, Vec force) { add(i, force, 1), add(j, force, -1); };
            for (const auto& e : all["springforce"]) {
                const Element& edge = all["edge"].at(get(e, "edge"));
                const std::size_t i = get(edge, "i"), j = get(edge, "j");
                add_pair(i, j, spring(x[i], x[j], v[i], v[j], get(e, "k"), get(e, "l0"), get(e, "b")));
            }
            for (const auto& e : all["gravitationalforce"]) {
                const std::size_t i = get(e, "i"), j = get(e, "j");
                add_pair(i, j, gravitation(x[i], x[j], m[i], m[j], get(e, "G")));
            }
            for (std::size_t i = 0; i < m.size(); ++i) {
                const Vec old = v[i];
                if (get(particles[i], "fixed") != 1) v[i] = {old.x + dt * f[i].x / m[i], old.y + dt * f[i].y / m[i]};
                const Vec by = is_explicit ? old : v[i];
                x[i] = {x[i].x + dt * by.x, x[i].y + dt * by.y};
            }
        }
        std::fprintf(trace, "\n%d,%.17g", step, step * dt);
        for (std::size_t i = 0; i < m.size(); ++i)
            std::fprintf(trace, ",%.17g,%.17g,%.17g,%.17g", x[i].x, x[i].y, v[i].x, v[i].y);
    }
    std::fprintf(trace, "\n");
    std::fclose(trace);
}
