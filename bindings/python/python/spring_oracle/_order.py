"""Properties of a time integrator: order, limit of stability, drift of energy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

from . import _native


@dataclass(frozen=True)
class OrderReport:
    """The order of a method, with its error bar."""

    order: float
    error_bar: float
    steps: list[float]
    errors: list[float]

    def __repr__(self) -> str:
        return f"order {self.order:.2f} ± {self.error_bar:.2f}, of {len(self.steps)} steps from {self.steps[-1]:.1e} to {self.steps[0]:.1e}"


def check_order(step: Callable, y0, t_end: float = 1.0, *, exact=None, first: float = 0.1, levels: int = 7) -> OrderReport:
    """Measures the order of `step(y, h) -> y` from `y0` to `t_end`.

    `exact` is the solution at `t_end`; without it, the method's own solution at half of the shortest step stands in. The error bar is
    twice the standard error of the fitted slope, and at least the change of the last two slopes.
    """
    y0 = np.asarray(y0, dtype=float)

    def run(h):
        count = max(1, round(t_end / h))
        y = y0.copy()
        for _ in range(count):
            y = np.asarray(step(y, t_end / count), dtype=float)
        return t_end / count, y

    runs = [run(first / 2**level) for level in range(levels + (exact is None))]
    reference = np.asarray(exact, dtype=float) if exact is not None else runs.pop()[1]
    steps = np.array([h for h, _ in runs])
    errors = np.array([np.abs(y - reference).max() for _, y in runs])
    # Where rounding takes over, errors fall no further.
    floor = 1e3 * np.finfo(float).eps * max(np.abs(reference).max(), 1e-300)
    keep = (errors > floor) & np.isfinite(errors)
    if exact is None:
        keep[-1] = False
    if keep.sum() < 3:
        raise ValueError("fewer than three steps have an error above rounding: choose a longer first step, or more levels")
    x, y = np.log(steps[keep][-4:]), np.log(errors[keep][-4:])
    (slope, offset), residual = np.polyfit(x, y, 1), 0.0
    if x.size > 2:
        residual = float(np.sqrt(((y - slope * x - offset) ** 2).sum() / (x.size - 2) / ((x - x.mean()) ** 2).sum()))
    slopes = np.diff(y) / np.diff(x)
    bar = max(2 * residual, abs(slopes[-1] - slopes[-2]) if slopes.size > 1 else 0.0)
    return OrderReport(float(slope), float(bar), steps[keep].tolist(), errors[keep].tolist())


@dataclass(frozen=True)
class StabilityReport:
    """The longest stable step of a method on the oscillator `x'' = −x − 2 ζ x'`, and that of an integrator. It is true if they agree."""

    limit: float
    """The longest step up to which no solution grows; infinite if none was found."""
    theory: float
    damping_ratio: float

    def __bool__(self) -> bool:
        return self.limit == self.theory or abs(self.limit - self.theory) <= 1e-6 * max(1.0, self.theory)

    def __repr__(self) -> str:
        verdict = "as theory says" if self else f"theory: {self.theory:.9g}"
        return f"stable up to h = {self.limit:.9g} for ζ = {self.damping_ratio:g}; {verdict}"


def check_stability(step: Callable, integrator: str, damping_ratio: float = 0.0, *, longest: float = 100.0) -> StabilityReport:
    """Measures the longest stable step of `step(y, h) -> y`, which must solve `y = (x, v)`, `x' = v`, `v' = −x − 2 ζ v`.

    The step is linear there: its matrix is read off at (1, 0) and (0, 1), and the first step at which an eigenvalue leaves the
    unit circle is bisected. Steps above `longest` are not tried. Theory is that of the integrator, by its name.
    """

    def is_stable(h):
        matrix = np.array([np.asarray(step(np.array(unit), h), dtype=float) for unit in ((1.0, 0.0), (0.0, 1.0))]).T
        # A double eigenvalue on the circle is off by the root of the rounding.
        return np.isfinite(matrix).all() and np.abs(np.linalg.eigvals(matrix)).max() <= 1 + 1e-7

    theory = _native.stable_steps(integrator, damping_ratio)[0]
    stable, limit = 0.0, float("inf")
    for h in np.geomspace(1e-3, longest, 4000):
        if not is_stable(h):
            unstable = h
            for _ in range(60):
                middle = 0.5 * (stable + unstable)
                stable, unstable = (middle, unstable) if is_stable(middle) else (stable, middle)
            limit = stable
            break
        stable = h
    return StabilityReport(float(limit), theory if theory <= longest else float("inf"), damping_ratio)


@dataclass(frozen=True)
class DriftReport:
    """The drift of an energy along a solution. It is true if there is none within three error bars."""

    drift: float
    """Change in a unit of time, relative to the energy at the start."""
    error_bar: float
    oscillation: float
    """The largest deviation from the drift, relative to the energy at the start."""

    def __bool__(self) -> bool:
        return abs(self.drift) <= 3 * self.error_bar

    def __repr__(self) -> str:
        verdict = "no drift" if self else "drifts"
        return f"energy {verdict}: {self.drift:.2e} ± {self.error_bar:.0e} in a unit of time, oscillates by {self.oscillation:.1e}"


def check_energy(step: Callable, y0, energy: Callable, h: float, steps: int = 10_000) -> DriftReport:
    """Measures whether `energy(y)` drifts over many steps of `step(y, h) -> y`.

    The drift is the slope of the means of twenty blocks; its error bar is the standard error of that slope, and at least the
    rounding of the energy, and what the part of an oscillation at the end of a block can change.
    """
    y = np.asarray(y0, dtype=float)
    values = [float(energy(y))]
    for _ in range(steps):
        y = np.asarray(step(y, h), dtype=float)
        values.append(float(energy(y)))
    values = np.array(values)
    size = abs(values[0]) or 1.0
    if not np.isfinite(values).all():
        return DriftReport(float("inf"), 0.0, float("inf"))
    count = 20
    length = values.size // count
    if length < 2:
        raise ValueError(f"{steps} steps are too few for {count} blocks: take more")
    means = values[: count * length].reshape(count, length).mean(1)
    times = h * length * (np.arange(count) + 0.5)
    slope, offset = np.polyfit(times, means, 1)
    residual = means - slope * times - offset
    spread = ((times - times.mean()) ** 2).sum()
    deviation = values - slope * h * np.arange(values.size) - offset
    oscillation = np.abs(deviation).max()
    period = 2 * values.size / max(1, np.count_nonzero(np.diff(np.sign(deviation))))
    partial = oscillation * period / (np.pi * length) / times[-1]
    rounding = np.finfo(float).eps * size * np.sqrt(values.size) / times[-1]
    bar = max(np.sqrt((residual**2).sum() / (count - 2) / spread), rounding, partial)
    return DriftReport(float(slope / size), float(bar / size), float(oscillation / size))
