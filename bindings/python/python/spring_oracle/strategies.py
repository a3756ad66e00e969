"""Strategies of hypothesis: scenes that a simulator must be able to run."""

from __future__ import annotations

from typing import Any, Sequence

from hypothesis import assume
from hypothesis import strategies as st

from . import _native
from ._scene import Scene


@st.composite
def scenes(
    draw: Any, *, forces: Sequence[str] | None = None, integrators: Sequence[str] | None = None, dimension: int | None = None,
    max_particles: int = 6, max_forces: int = 4, steps: int = 20,
) -> Scene:  # fmt: skip
    """Scenes of a few particles at different places, with forces whose parameters are of the usual size.

    `forces` and `integrators` choose among `forces()` and `integrators()`. What an integrator refuses is not drawn.
    """
    known = {of["kind"]: of for of in _native.forces()}
    kinds = [of for kind, of in known.items() if forces is None or {kind, kind.removesuffix("force")} & set(forces)]
    names = [name for name, _ in _native.integrators()] if integrators is None else list(integrators)
    axes = draw(st.sampled_from([2, 3])) if dimension is None else dimension
    time_step = draw(st.sampled_from([0.001, 0.004, 0.01]))
    scene = Scene(draw(st.sampled_from(names)), time_step=time_step, duration=steps * time_step, dimension=axes)
    offsets = st.lists(st.floats(-0.3, 0.3), min_size=axes, max_size=axes)
    speeds = st.lists(st.floats(-1, 1), min_size=axes, max_size=axes)
    for number in range(draw(st.integers(1, max_particles))):
        place = [float(number), *([0.7 * (number % 2)] * (axes - 1))]
        position = [base + offset for base, offset in zip(place, draw(offsets))]
        scene.particle(position, draw(speeds), mass=draw(st.floats(0.25, 4)), fixed=draw(st.integers(0, 3)) == 0)
    particles = len(scene.masses)
    usable = [of for of in kinds if of["least_dimension"] <= axes and (of["field"] or of["size"] <= particles)]
    for _ in range(draw(st.integers(0, max_forces)) if usable else 0):
        kind = draw(st.sampled_from(usable))
        chosen = draw(st.permutations(range(particles)))[: kind["size"]]
        attributes: dict[str, Any] = dict(zip(kind["particles"], chosen))
        if kind["particles"] == ["edge"]:
            attributes = {"edge": scene.edge(*chosen)}
        for parameter in kind["parameters"]:
            if parameter["required"] and (axes == 3 or not parameter["three_dimensional"]):
                attributes[parameter["name"]] = draw(st.floats(*parameter["typical"]))
        try:
            scene.force(kind["kind"], **attributes)
        except _native.SceneError:
            # The integrator does not take such a force.
            assume(False)
    return scene
