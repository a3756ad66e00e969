"""The order of a method, from its errors at falling steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np


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
