"""Plots by matplotlib, which is imported here alone."""

from __future__ import annotations

from typing import Any, Sequence

import numpy as np


def _axes(ax: Any, **size: Any) -> Any:
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained", **size)[1]


def _edges(ax: Any, positions: np.ndarray, edges: Sequence[tuple[int, int]], **style: Any) -> None:
    from matplotlib.collections import LineCollection

    ax.add_collection(LineCollection([positions[list(edge), :2] for edge in edges], **style))


def scene(scene: Any, ax: Any = None) -> Any:
    ax = _axes(ax, figsize=(4, 4))
    at, fixed = scene.positions, scene.fixed
    _edges(ax, at, scene.edges, color="0.6", linewidth=1, zorder=0)
    ax.scatter(*at[~fixed, :2].T, s=24, color="C0")
    ax.scatter(*at[fixed, :2].T, s=30, color="C3", marker="s")
    ax.set_aspect("equal", "datalim")
    ax.set(xlabel="x", ylabel="y")
    return ax


def trajectories(trace: Any, ax: Any = None, particles: Sequence[int] | None = None) -> Any:
    ax = _axes(ax, figsize=(4.5, 4))
    shown = range(trace.positions.shape[1]) if particles is None else particles
    for particle in shown:
        (line,) = ax.plot(*trace.positions[:, particle, :2].T, linewidth=1)
        ax.plot(*trace.positions[-1, particle, :2], "o", color=line.get_color(), markersize=4)
    if trace.scene is not None:
        _edges(ax, trace.positions[-1], trace.scene.edges, color="0.7", linewidth=0.8, zorder=0)
    ax.set_aspect("equal", "datalim")
    ax.set(xlabel="x", ylabel="y")
    return ax


def energies(trace: Any, ax: Any = None) -> Any:
    ax = _axes(ax, figsize=(5, 3))
    kinetic, potential = trace.energies()
    for name, values in (("kinetic", kinetic), ("potential", potential), ("total", kinetic + potential)):
        ax.plot(trace.times, values, label=name, linewidth=2 if name == "total" else 1)
    ax.set(xlabel="t", ylabel="energy")
    ax.legend(frameon=False)
    return ax


def errors(stated: np.ndarray, measured: np.ndarray, block: int, ax: Any = None) -> Any:
    """The errors of a Jacobian relative to its largest entry, as powers of ten, with lines between the blocks of particles."""
    rows, columns = stated.shape
    ax = _axes(ax, figsize=(4.8, 4))
    size = np.nanmax(np.abs(measured), initial=0.0) or 1.0
    with np.errstate(divide="ignore"):
        error = np.log10(np.abs(stated - measured) / size)
    picture = ax.imshow(np.clip(error, -16, 0), cmap="magma_r", vmin=-16, vmax=0)
    for place in range(block, columns, block):
        ax.axvline(place - 0.5, color="0.5", linewidth=0.6)
    for place in range(block, rows, block):
        ax.axhline(place - 0.5, color="0.5", linewidth=0.6)
    ax.set(xlabel="variable", ylabel="value")
    ax.figure.colorbar(picture, ax=ax, label="error, power of ten of the largest entry")
    return ax


def blocks(report: Any, axes: Any = None) -> Any:
    """The blocks of a force that are wrong, or all: as stated, as measured, and their difference."""
    shown = [of for of in report.blocks if of["verdict"] == "wrong"] or report.blocks
    shown = [of for of in shown if "yours" in of]
    if axes is None:
        import matplotlib.pyplot as plt

        size = (6.5, 2.1 * len(shown))
        axes = plt.subplots(len(shown), 3, figsize=size, squeeze=False, layout="constrained")[1]
    for row, of in zip(np.atleast_2d(axes), shown):
        yours, measured = np.array(of["yours"]), np.array(of["measured"])
        size = np.nanmax(np.abs([yours, measured])) or 1.0
        for ax, values, title in zip(row, (yours, measured, yours - measured), ("yours", "measured", "difference")):
            ax.imshow(values, cmap="RdBu", vmin=-size, vmax=size)
            for place, value in np.ndenumerate(values):
                colour = "white" if abs(value) > 0.6 * size else "black"
                ax.text(*place[::-1], f"{value:.2g}", ha="center", va="center", fontsize=8, color=colour)
            ax.set(xticks=[], yticks=[], title=f"{of['name']}: {title}" if title == "yours" else title)
    return axes
