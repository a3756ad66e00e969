"""Checks of forces between two particles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

from ._check import Report, check_jacobian


def _spring(x, v, p):
    d, w = x[1] - x[0], v[1] - v[0]
    length = np.sqrt(d @ d)
    n = d / length
    return -(p["stiffness"] * (length - p["rest_length"]) + p["damping"] * (n @ w)) * n


def _gravitation(x, v, p):
    d = x[1] - x[0]
    return -p["G"] * p["masses"][0] * p["masses"][1] * d / np.sqrt(d @ d) ** 3


# The force on the second particle; that on the first is minus it.
_LAWS = {"spring": _spring, "gravitation": _gravitation}
_PARAMETERS = {
    "spring": {"stiffness": 9.0, "rest_length": 0.8, "damping": 0.7},
    "gravitation": {"G": 1.3, "masses": (1.2, 0.7)},
}


@dataclass(frozen=True)
class ForceReport:
    """A force against its law, and its Jacobians against itself. It is true if all are correct."""

    force_error: float
    """The largest difference from the law, relative to the largest force."""
    worst: tuple[np.ndarray, np.ndarray] | None
    """Positions and velocities where it is off."""
    sign: str | None
    """`gradient` if the force is exactly the negative of the law: the gradient of its energy."""
    by_position: Report
    by_velocity: Report | None

    def __bool__(self) -> bool:
        return self.worst is None and bool(self.by_position) and (self.by_velocity is None or bool(self.by_velocity))

    def __repr__(self) -> str:
        if self.worst is None:
            lines = ["force: correct"]
        elif self.sign:
            lines = ["force: exactly the negative. Yours is the gradient of the energy, not the force"]
        else:
            lines = [f"force: wrong, by {self.force_error:.1e} at x = {self.worst[0].tolist()}, v = {self.worst[1].tolist()}"]
        lines.append(f"dF/dx: {self.by_position}")
        if self.by_velocity is not None:
            lines.append(f"dF/dv: {self.by_velocity}")
        return "\n".join(lines)


def check_force(
    force: Callable, jacobian_x: Callable, jacobian_v: Callable | None = None, *, kind: str = "spring", dimension: int = 2,
    seed: int = 1, **parameters: float,
) -> ForceReport:  # fmt: skip
    """Checks a force between two particles: `force(x, v)`, `jacobian_x(x, v)`, `jacobian_v(x, v)`, of flat vectors of two particles.

    `kind` is `spring` (parameters `stiffness`, `rest_length`, `damping`) or `gravitation` (`G`, `masses`). States are drawn, and hard
    ones among them: compressed, stretched, at the rest length, along an axis, at rest, and with velocities along and across.
    """
    if kind not in _LAWS:
        raise ValueError(f"there is no law {kind!r}; there are {', '.join(_LAWS)}")
    unknown = set(parameters) - set(_PARAMETERS[kind])
    if unknown:
        raise ValueError(f"{kind} has no parameter {', '.join(sorted(unknown))}; it has {', '.join(_PARAMETERS[kind])}")
    p = {**_PARAMETERS[kind], **parameters}
    states = _states(dimension, p.get("rest_length", 1.0), np.random.default_rng(seed))
    error, worst, negative = 0.0, None, True
    for x, v in states:
        law = _LAWS[kind](x.reshape(2, -1), v.reshape(2, -1), p)
        law = np.concatenate([-law, law])
        found = np.asarray(force(x.copy(), v.copy()), dtype=float).ravel()
        size = max(np.abs(law).max(), 1e-300)
        off = np.abs(found - law).max() / size
        negative &= bool(np.abs(found + law).max() <= 1e-10 * size)
        if not off <= 1e-10 and (worst is None or off > error):
            error, worst = off, (x, v)
    sign = "gradient" if worst is not None and negative else None
    x0, v0 = states[0]
    points = np.array([x for x, _ in states])
    by_position = check_jacobian(lambda x: force(x, v0), lambda x: jacobian_x(x, v0), points, block=dimension)
    by_velocity = None
    if jacobian_v is not None:
        speeds = np.array([v for _, v in states])
        by_velocity = check_jacobian(lambda v: force(x0, v), lambda v: jacobian_v(x0, v), speeds, block=dimension)
    return ForceReport(error, worst, sign, by_position, by_velocity)


def _states(dimension: int, length: float, rng: np.random.Generator) -> list[tuple[np.ndarray, np.ndarray]]:
    states = []
    for stretch in (None, None, None, 0.01, 0.75, 1.0, 1.5, 100.0):
        a, d = rng.uniform(-1, 1, dimension), rng.normal(size=dimension)
        d *= (rng.uniform(0.5, 3.0) if stretch is None else stretch * length) / np.linalg.norm(d)
        states.append((np.concatenate([a, a + d]), rng.normal(size=2 * dimension)))
    axis = np.zeros(2 * dimension)
    axis[dimension] = 1.3
    states.append((axis, rng.normal(size=2 * dimension)))
    x, _ = states[0]
    d = x[dimension:] - x[:dimension]
    across = np.zeros(dimension)
    across[0], across[1] = -d[1], d[0]
    for relative in (np.zeros(dimension), d, across):
        states.append((x, np.concatenate([np.zeros(dimension), relative])))
    return states
