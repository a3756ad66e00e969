"""Checks of forces, Jacobians, integrators and traces, with a verdict: correct, wrong or inconclusive.

    >>> import numpy as np, spring_oracle
    >>> spring_oracle.check_jacobian(np.sin, lambda x: np.diag(np.cos(x)), [0.3, 0.7]).verdict
    'correct'

Shapes: `x` has n numbers, `f(x)` m numbers, a Jacobian is m × n: an array, a scipy sparse matrix, or a function of `(x, v)` that
returns its product with `v` (`products=True`). States of a trace are `positions[step, particle, axis]`. There is no step size to
choose. Units are those of the function, or of the scene.
"""

from ._check import Report, by_complex_step, check_gradient, check_hessian, check_jacobian
from ._force import ForceReport, check_force
from ._grade import ClassReport, GradeError, GradeReport, grade, grade_class
from ._native import SceneError, SimulationError, TraceError, __version__, forces, integrators
from ._order import DriftReport, OrderReport, StabilityReport, check_energy, check_order, check_stability
from ._scene import COURSE, Comparison, Scene, Trace, compare, load_trace, simulate

__all__ = [
    "COURSE", "ClassReport", "Comparison", "DriftReport", "ForceReport", "GradeError", "GradeReport", "OrderReport", "Report", "Scene",
    "SceneError", "SimulationError", "StabilityReport", "Trace", "TraceError", "__version__", "by_complex_step", "check_energy",
    "check_force", "check_gradient", "check_hessian", "check_jacobian", "check_order", "check_stability", "compare", "forces", "grade",
    "grade_class", "integrators", "load_trace", "simulate",
]  # fmt: skip
