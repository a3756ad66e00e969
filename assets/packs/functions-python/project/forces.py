"""Forces of a mass-spring system. Points, velocities and forces are pairs [x, y]; return the force, not its potential."""

import math


def simple_gravity(m, g):
    """The force of gravity g on a particle of mass m."""
    raise NotImplementedError("simple_gravity")


def spring(xi, xj, vi, vj, k, l0, b):
    """The force on particle i of a spring to particle j with stiffness k, rest length l0 and damping b; j feels the opposite."""
    raise NotImplementedError("spring")


def gravitation(xi, xj, mi, mj, G):
    """The force on particle i of the attraction by particle j with the constant G; j feels the opposite."""
    raise NotImplementedError("gravitation")


def drag(v, b):
    """The force of drag b on a particle with velocity v."""
    raise NotImplementedError("drag")
