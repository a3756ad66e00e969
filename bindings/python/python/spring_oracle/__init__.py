"""Checks of Jacobians, gradients and Hessians, with a verdict: correct, wrong or inconclusive.

    >>> import numpy as np, spring_oracle
    >>> spring_oracle.check_jacobian(np.sin, lambda x: np.diag(np.cos(x)), [0.3, 0.7]).verdict
    'correct'

Shapes: `x` has n numbers, `f(x)` m numbers, a Jacobian is m × n: an array, a scipy sparse matrix, or a function of `(x, v)` that
returns its product with `v` (`products=True`). There is no step size to choose. Units are those of the function.
"""

from ._check import Report, check_gradient, check_hessian, check_jacobian
from ._force import ForceReport, check_force
from ._native import __version__
from ._order import OrderReport, check_order

__all__ = [
    "ForceReport", "OrderReport", "Report", "__version__", "check_force", "check_gradient", "check_hessian", "check_jacobian",
    "check_order",
]  # fmt: skip
