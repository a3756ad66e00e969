"""Checks of functions with their derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Callable, Mapping, Sequence

import numpy as np

from . import _native


@dataclass(frozen=True)
class Report:
    """The result of a check. It is true if the derivative is correct."""

    verdict: str
    """`correct`, `correct-zero`, `wrong` or `inconclusive`."""
    reason: str | None
    """Why it is inconclusive."""
    likeness: str | None
    """The pattern of the error."""
    on_branch: bool
    """Whether it is wrong at some states and right at others."""
    wrong: list[tuple[int, int]]
    """Row and column of the wrong entries."""
    undecided: list[tuple[int, int]]
    """Row and column of the entries without a verdict at any state."""
    bound: float
    """The largest bound of an entry that is right, relative to the largest one of its row."""
    slope: float | None
    """Of Taylor's remainder: 2 where the derivative is right."""
    window: tuple[float, float] | None
    """The steps over which the slope was fitted."""
    calls: tuple[int, int]
    """Calls of the function and of its derivative."""
    single_precision: tuple[bool, bool]
    """Whether the values, and the derivative, are in single precision."""
    states: list[dict[str, Any]]
    """Each state: name, x, verdict, number of wrong entries, kinks, jumps, and noise relative to the largest value."""
    properties: list[tuple[str, str, float]]
    """Name, verdict and violation of each property that was asked for."""
    text: str
    """All of it for a reader."""
    block: int = 1
    """Number of coordinates of a particle."""
    worst: dict[str, Any] | None = None
    """The entry that supports the verdict: row, column, yours, measured, bound, state, x."""
    complex_step: float | None = None
    """The largest difference to the derivative by complex steps, relative to its largest entry; `None` if it was not asked for."""
    matrices: tuple[np.ndarray, np.ndarray] | None = None
    """The Jacobian at the state of the worst wrong entry: as stated, and as measured where that contradicts it."""

    def __bool__(self) -> bool:
        return self.verdict.startswith("correct")

    def __repr__(self) -> str:
        if self.complex_step is None:
            return self.text
        return f"{self.text}\n  complex step: off by {self.complex_step:.1e} of the largest entry"

    def _repr_html_(self) -> str:
        from . import _html

        return _html.block(self.verdict, repr(self))

    def plot(self, ax: Any = None) -> Any:
        """The errors at the state of the worst entry, by matplotlib: powers of ten, with lines between blocks."""
        from . import _plots

        if self.matrices is None:
            raise ValueError("no entry is wrong: there is no error to draw")
        return _plots.errors(*self.matrices, self.block, ax)


def _array(value: Any) -> np.ndarray:
    # Of torch and jax, arrays that numpy reads without a copy.
    if hasattr(value, "detach"):
        value = value.detach().cpu()
    if hasattr(value, "toarray"):
        value = value.toarray()
    return np.ascontiguousarray(value, dtype=np.float64)


def _vector(value: Any) -> np.ndarray:
    return _array(value).ravel()


def check_jacobian(
    f: Callable,
    jacobian: Callable,
    x: Any = None,
    *,
    domain: tuple[Any, Any] | None = None,
    products: bool = False,
    draws: int = 4,
    search: bool = True,
    seed: int = 1,
    block: int = 1,
    factors: Mapping[str, float] | None = None,
    properties: Sequence[str] = (),
    complex_step: bool = False,
) -> Report:
    """Checks `jacobian` as the derivative of `f`, at `x` (one point, or several as rows) and in the box `domain`.

    Points are drawn from the box, and states on every branch are searched for in it. `block` is the number of coordinates of a
    particle, `factors` names numbers by which a derivative may be off (`{"h": 0.01}`), `properties` are of `symmetry`,
    `translation` and `rotation`. With `complex_step`, `f` takes complex numbers, and must be analytic (no `abs`, no conjugate): the
    derivative by complex steps, exact to rounding, is one more opinion in the report. An exception of a callback is raised, with its traceback.
    """
    settings: dict[str, Any] = dict(draws=draws, search=search, seed=seed, block=block, properties=list(properties))
    settings["factors"] = list((factors or {}).items())
    some = None
    if domain is not None:
        lower, upper = (_vector(bound) for bound in domain)
        if lower.size != upper.size:
            raise ValueError(f"the lower bounds are {lower.size} numbers, and the upper ones {upper.size}")
        settings["domain"] = (lower.tolist(), upper.tolist())
        some = 0.5 * (lower + upper)
    if x is not None:
        points = np.ascontiguousarray(np.atleast_2d(np.asarray(x, dtype=np.float64)))
        if domain is not None and points.shape[1] != some.size:
            raise ValueError(f"x has {points.shape[1]} numbers, and the bounds {some.size}")
        settings["points"] = points
        some = points[0]
    if some is None:
        raise ValueError("give a point x, or a domain (lower, upper)")
    shape = (_vector(f(some.copy())).size, some.size)
    given = None if products else jacobian(some.copy())

    def value(at):
        return _vector(f(at))

    if products:
        kind, derivative = "product", lambda at, v: _vector(jacobian(at, v))
    elif hasattr(given, "tocoo"):
        kind = "sparse"

        def derivative(at):
            matrix = jacobian(at).tocoo()
            _expect(matrix.shape, shape)
            return matrix.row.astype(np.int64), matrix.col.astype(np.int64), np.ascontiguousarray(matrix.data, dtype=np.float64)

    else:
        kind = "dense"

        def derivative(at):
            matrix = _array(jacobian(at))
            _expect(matrix.shape if matrix.ndim == 2 or 1 not in shape else shape, shape)
            return matrix.ravel()

    report = Report(**_native.check_jacobian(value, derivative, kind, shape, settings), block=block)
    if not complex_step:
        return report
    units = np.eye(shape[1])
    off = [0.0]
    for at in (np.array(state["x"]) for state in report.states):
        exact = by_complex_step(f, at)
        product = (lambda: np.array([_vector(jacobian(at, unit)) for unit in units]).T) if products else lambda: _array(jacobian(at))
        off.append(np.abs(product().reshape(shape) - exact).max() / (np.abs(exact).max() or 1.0))
    return replace(report, complex_step=float(max(off)))


def by_complex_step(f: Callable, x: Any) -> np.ndarray:
    """The Jacobian of `f` by complex steps, `Im f(x + ih e) / h`: exact to rounding where `f` is analytic and takes complex numbers."""
    x, h = _vector(x), 1e-100
    columns = []
    for place in range(x.size):
        at = x.astype(complex)
        at[place] += 1j * h
        values = np.asarray(f(at)).ravel()
        if not np.iscomplexobj(values):
            raise TypeError("f returns real numbers at complex arguments: it is not written for complex steps")
        columns.append(values.imag / h)
    return np.array(columns).T


def _expect(found: tuple, shape: tuple[int, int]) -> None:
    if tuple(found) != shape:
        raise ValueError(f"the Jacobian is {found}; it must be {shape}: a row a value, a column a variable")


def check_gradient(energy: Callable, gradient: Callable, x: Any = None, **options: Any) -> Report:
    """Checks `gradient` as the derivative of the number `energy(x)`. A force is reported as exactly the negative."""
    return check_jacobian(lambda at: np.atleast_1d(_vector(energy(at))), lambda at: _vector(gradient(at))[None, :], x, **options)


def check_hessian(gradient: Callable, hessian: Callable, x: Any = None, **options: Any) -> Report:
    """Checks `hessian` as the derivative of `gradient`, and its symmetry."""
    options["properties"] = list(dict.fromkeys([*options.get("properties", ()), "symmetry"]))
    return check_jacobian(gradient, hessian, x, **options)
