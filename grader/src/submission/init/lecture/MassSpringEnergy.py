"""The energy of the springs, sum of l^2 k/2 (|x_a - x_b|^2 / l^2 - 1)^2.

x is a list of points; e are pairs of their numbers, l2 and k the squared rest length and the stiffness of each pair.
"""

from utils import make_PD, not_implemented


def val(x, e, l2, k):
    # your code here
    not_implemented("MassSpringEnergy.val")


def grad(x, e, l2, k):
    """A list of vectors, one for each point."""
    # your code here
    not_implemented("MassSpringEnergy.grad")


def hess(x, e, l2, k):
    """Rows, columns and values: [I, J, V]. The block of each spring is projected by make_PD."""
    # your code here
    not_implemented("MassSpringEnergy.hess")
