#include "forces.h"

#include <cmath>

Vec simple_gravity(double m, Vec g) {
    not_implemented("simple_gravity");
}

Vec spring(Vec xi, Vec xj, Vec vi, Vec vj, double k, double l0, double b) {
    not_implemented("spring");
}

Vec gravitation(Vec xi, Vec xj, double mi, double mj, double G) {
    not_implemented("gravitation");
}

Vec drag(Vec v, double b) {
    not_implemented("drag");
}
