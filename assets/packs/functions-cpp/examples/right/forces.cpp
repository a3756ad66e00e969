#include "forces.h"

#include <cmath>

Vec simple_gravity(double m, Vec g) {
    return {m * g.x, m * g.y};
}

Vec spring(Vec xi, Vec xj, Vec vi, Vec vj, double k, double l0, double b) {
    const Vec d = {xi.x - xj.x, xi.y - xj.y};
    const double length = std::hypot(d.x, d.y);
    const Vec n = {d.x / length, d.y / length};
    const double speed = n.x * (vi.x - vj.x) + n.y * (vi.y - vj.y);
    const double size = -k * (length - l0) - b * speed;
    return {size * n.x, size * n.y};
}

Vec gravitation(Vec xi, Vec xj, double mi, double mj, double G) {
    const Vec d = {xi.x - xj.x, xi.y - xj.y};
    const double size = -G * mi * mj / std::pow(std::hypot(d.x, d.y), 3);
    return {size * d.x, size * d.y};
}

Vec drag(Vec v, double b) {
    return {-b * v.x, -b * v.y};
}
