"""Forces of a mass-spring system. Points, velocities and forces are pairs [x, y]; return the force, not its potential."""

import math


def simple_gravity(m, g):
    """The force of gravity g on a particle of mass m."""
    return [m * g[0], m * g[1]]


def spring(xi, xj, vi, vj, k, l0, b):
    """The force on particle i of a spring to particle j with stiffness k, rest length l0 and damping b; j feels the opposite."""
    d = [xi[0] - xj[0], xi[1] - xj[1]]
    length = math.hypot(*d)
    n = [d[0] / length, d[1] / length]
    speed = n[0] * (vi[0] - vj[0]) + n[1] * (vi[1] - vj[1])
    size = -k * (length - l0) - b * speed
    return [size * n[0], size * n[1]]


def gravitation(xi, xj, mi, mj, G):
    """The force on particle i of the attraction by particle j with the constant G; j feels the opposite."""
    d = [xi[0] - xj[0], xi[1] - xj[1]]
    length = math.hypot(*d)
    size = -G * mi * mj / length**3
    return [size * d[0], size * d[1]]


def drag(v, b):
    """The force of drag b on a particle with velocity v."""
    return [-b * v[0], -b * v[1]]
