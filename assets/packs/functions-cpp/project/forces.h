// Forces of a mass-spring system; each returns the force, not its potential.
#pragma once

struct Vec {
    double x, y;
};

// The force of gravity g on a particle of mass m.
Vec simple_gravity(double m, Vec g);

// The force on particle i of a spring to particle j with stiffness k, rest length l0 and damping b; j feels the opposite.
Vec spring(Vec xi, Vec xj, Vec vi, Vec vj, double k, double l0, double b);

// The force on particle i of the attraction by particle j with the constant G; j feels the opposite.
Vec gravitation(Vec xi, Vec xj, double mi, double mj, double G);

// The force of drag b on a particle with velocity v.
Vec drag(Vec v, double b);

// Ends the program: a scene needs what is not there yet.
[[noreturn]] void not_implemented(const char* name);
