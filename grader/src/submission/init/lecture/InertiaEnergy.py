"""The inertia energy of the incremental potential, sum of m_i |x_i - x_tilde_i|^2 / 2.

x and x_tilde are lists of points, m of masses.
"""

from utils import not_implemented


def val(x, x_tilde, m):
    # your code here
    not_implemented("InertiaEnergy.val")


def grad(x, x_tilde, m):
    """A list of vectors, one for each point."""
    # your code here
    not_implemented("InertiaEnergy.grad")


def hess(x, x_tilde, m):
    """Rows, columns and values: [I, J, V], where the coordinates of point i have the numbers 2 i and 2 i + 1."""
    # your code here
    not_implemented("InertiaEnergy.hess")
