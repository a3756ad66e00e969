"""Projected Newton with line search, for implicit Euler."""

import InertiaEnergy
import MassSpringEnergy
from utils import not_implemented, solve


def step_forward(x, e, v, m, l2, k, h, tol, fixed):
    """The positions and velocities after a step of length h: [x, v].

    tol bounds the largest |p_x| + |p_y| of a particle, over h: the lecture's norm(p, inf) of the search direction p. The last
    p, which is within tol, is not applied; but at least one iteration is made. A particle with fixed[i] keeps its velocity,
    and moves by it.
    """
    # your code here
    not_implemented("step_forward")


def IP_val(x, e, x_tilde, m, l2, k, h):
    """The incremental potential."""
    # your code here
    not_implemented("IP_val")


def IP_grad(x, e, x_tilde, m, l2, k, h):
    # your code here
    not_implemented("IP_grad")


def IP_hess(x, e, x_tilde, m, l2, k, h):
    # your code here
    not_implemented("IP_hess")


def search_dir(x, e, x_tilde, m, l2, k, h, fixed):
    """The solution p of hess p = -grad; utils.solve(A, b) solves a system whose matrix is a list of rows."""
    # your code here
    not_implemented("search_dir")
