"""Checks of forces against the laws of the simulator."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any, Callable, Sequence

import numpy as np

from . import _native
from ._check import _array, _vector


@dataclass(frozen=True)
class ForceReport:
    """A force against its law, and its Jacobians by three estimates. It is true if all is correct."""

    kind: str
    """The force."""
    dimension: int
    """2 or 3."""
    states: int
    """Number of states checked: random ones and hard ones."""
    blocks: list[dict[str, Any]]
    """Each kind of block: name, verdict, reason, evidence, error and bound relative to its largest entry, the worst block as stated
    (`yours`) and as `measured`, its state, and what the error looks like (`likeness`)."""
    properties: list[dict[str, Any]]
    """Force, symmetry, translation, rotation, and with an energy gradient and Hessian: name, verdict, error, state."""

    @property
    def verdict(self) -> str:
        """`correct`, `wrong` or `inconclusive`."""
        verdicts = {of["verdict"] for of in (*self.blocks, *self.properties)}
        return next((verdict for verdict in ("wrong", "inconclusive") if verdict in verdicts), "correct")

    @property
    def wrong(self) -> list[str]:
        """The names of what is wrong."""
        return [of["name"] for of in (*self.properties, *self.blocks) if of["verdict"] == "wrong"]

    @property
    def likeness(self) -> str | None:
        """The pattern of the first wrong block."""
        return next((of["likeness"] for of in self.blocks if of.get("likeness")), None)

    @property
    def sign(self) -> str | None:
        """`gradient` if the force is exactly the negative of the law: the gradient of the energy."""
        force = next(of for of in self.properties if of["name"] == "force")
        if force["verdict"] != "wrong" or "law" not in force:
            return None
        size = np.abs(force["law"]).max()
        return "gradient" if size > 0 and np.abs(force["yours"] + force["law"]).max() <= 1e-9 * size else None

    def __bool__(self) -> bool:
        return self.verdict == "correct"

    def __repr__(self) -> str:
        lines = [f"{self.kind} in {self.dimension}D: {self.verdict}, {self.states} states"]
        if self.sign:
            lines.append("  the force is exactly the negative of the law: it is the gradient of the energy, not the force")
        for of in (*self.properties, *self.blocks):
            text = f"  {of['name']}: {of['verdict']}"
            if of["reason"]:
                text += f", {of['reason']}"
            if of.get("likeness"):
                text += f", {of['likeness']}"
            if of.get("error") is not None and of["verdict"] == "wrong":
                text += f" (off by {of['error']:.1e} at the state {of['state']['name']!r})"
            if of.get("unseen") and of["verdict"] == "inconclusive":
                text += f"; no state shows {', '.join(of['unseen'])}"
            lines.append(text)
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from . import _html

        return _html.block(self.verdict, repr(self))

    def plot(self, axes: Any = None) -> Any:
        """The wrong blocks, or all: as stated, as measured, and their difference, by matplotlib."""
        from . import _plots

        return _plots.blocks(self, axes)


def _with_element(function: Callable | None, flat: bool) -> tuple[Callable | None, bool]:
    """The function of `(x, v, element)`, with arrays that the checks read, and whether it takes the element."""
    if function is None:
        return None, False
    try:
        inspect.signature(function).bind(None, None, None)
        takes = True
    except (TypeError, ValueError):
        # A function of two arguments, or one written in C, without a signature.
        takes = False
    call = function if takes else (lambda x, v, _: function(x, v))
    shape = _vector if flat else _array
    return (lambda x, v, p: shape(call(x, v, p))), takes


def check_force(
    force: Callable, jacobian_x: Callable | None = None, jacobian_v: Callable | None = None, *, kind: str, energy: Callable | None = None,
    dimension: int = 2, masses: Sequence[float] = (), states: int = 16, seed: int = 1, **parameters: float,
) -> ForceReport:  # fmt: skip
    """Checks a force of a kind that the simulator has (`forces()` lists them) against its law, and its Jacobians.

    A function takes `(x, v, p)`: flat positions and velocities of the particles of one element, and its facts: parameters by the names of
    scene files (`p.k`, `p.l0`, `p.b`), `p.masses`, `p.time`, and `p.start`, the initial positions. The force has as many numbers as `x`, a
    Jacobian as many rows and columns, the energy is a number. The states are those at which the simulator's own forces are checked: nearly
    zero length, compressed, stretched, at the rest length, far from the origin, mass ratios of 1e9, velocities along and across, parameters
    that are zero, elements that share particles.

    Functions of `(x, v)` alone have fixed parameters: give all of them, and the masses if the force depends on them. An exception of a
    function is raised, with its traceback. Ctrl-C works between calls.
    """
    if dimension not in (2, 3):
        raise ValueError(f"the dimension is {dimension}; it must be 2 or 3")
    functions = [_with_element(of, flat) for of, flat in ((force, True), (jacobian_x, False), (jacobian_v, False))]
    known = next((of for of in _native.forces() if of["kind"] in (kind, f"{kind}force")), None)
    if known is not None and not all(takes for function, takes in functions if function):
        shown = [of for of in known["parameters"] if dimension == 3 or not of["three_dimensional"]]
        absent = [of for of in shown if not {of["name"], of["meaning"].replace(" ", "_")} & set(parameters)]
        missing = ", ".join(of["name"] for of in absent if of["required"])
        if missing:
            raise ValueError(f"a function of (x, v) has fixed parameters: give {missing}, or let it take (x, v, p)")
        parameters.update({of["name"]: of["default"] for of in absent if of["default"] is not None})
    by_x, by_v = functions[1][0], functions[2][0]
    of_energy = None
    if energy is not None:
        of_state = _with_element(energy, True)[0]
        of_energy = lambda x, v, p: float(of_state(x, v, p)[0])
    arguments = {name: float(value) for name, value in parameters.items()}
    found = _native.check_force(
        functions[0][0], (by_x, by_v), of_energy, kind, dimension, arguments, [float(mass) for mass in masses], (states, seed)
    )  # fmt: skip
    return ForceReport(**found)
