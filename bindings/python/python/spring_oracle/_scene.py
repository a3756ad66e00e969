"""Scenes, their simulation, and traces as arrays."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Sequence

import numpy as np

from . import _native
from ._check import _array, _vector

#: The course's own tolerances: of each residual, and of their sum.
COURSE = (1e-10, 1e-6)


class Scene:
    """A scene: particles, edges, forces, an integrator with its time step and duration.

        >>> scene = Scene("implicit-euler", time_step=0.01, duration=1.0)
        >>> a, b = scene.particle([0, 0], fixed=True), scene.particle([1, 0], velocity=[0, 1], mass=2)
        >>> scene.force("spring", edge=scene.edge(a, b), k=100, l0=1, b=0.5)
        0

    What is added is read by the parser of scene files: `SceneError` has its messages. Options of the integrator are given by name.
    `forces()` and `integrators()` list what there is.
    """

    def __init__(
        self, integrator: str = "symplectic-euler", *, time_step: float = 0.01, duration: float = 1.0, dimension: int = 2, **options: Any
    ) -> None:
        self._native = _native.Scene(integrator, time_step, duration, dimension, options)

    @classmethod
    def _of(cls, native: Any) -> Scene:
        scene = cls.__new__(cls)
        scene._native = native
        return scene

    @classmethod
    def read(cls, path: str | os.PathLike, *, strict: bool = False) -> Scene:
        """The scene of a file: XML, or JSON with its mesh. `strict` refuses what is unknown; else it is in `warnings`."""
        return cls._of(_native.Scene.read(os.fspath(path), strict))

    @classmethod
    def from_xml(cls, text: str, *, name: str = "scene", strict: bool = False) -> Scene:
        """The scene of a text in XML. `name` stands in messages."""
        return cls._of(_native.Scene.parse(text, name, strict))

    def particle(
        self, position: Sequence[float], velocity: Sequence[float] | None = None, *, mass: float = 1.0, fixed: bool = False
    ) -> int:
        """Adds a particle, and returns its number."""
        position = [float(value) for value in position]
        velocity = [0.0] * len(position) if velocity is None else [float(value) for value in velocity]
        return self._native.particle(position, velocity, float(mass), fixed)

    def edge(self, i: int, j: int) -> int:
        """Adds an edge between two particles, and returns its number. It exerts no force by itself."""
        return self._native.edge(i, j)

    def force(self, kind: str, **attributes: Any) -> int:
        """Adds a force element with the attributes of scene files: `edge`, or `i` and `j`, and parameters. Returns its number."""
        return self._native.force(kind, attributes)

    def changed(
        self, integrator: str | None = None, *, time_step: float | None = None, duration: float | None = None, **options: Any
    ) -> Scene:
        """The same scene by another integrator, with another time step or duration."""
        return Scene._of(self._native.changed(integrator, time_step, duration, options))

    def to_xml(self) -> str:
        """The scene as a file of the course's schema."""
        return self._native.xml()

    def save(self, path: str | os.PathLike) -> None:
        """Writes the scene as XML."""
        Path(path).write_text(self.to_xml(), encoding="utf-8")

    def laws(self, x: Any = None, v: Any = None, time: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The force on all particles, its Jacobian by position and that by velocity, by the reference laws, at a state (the first)."""
        x, v = (self.positions if x is None else x), (self.velocities if v is None else v)
        return self._native.laws(_vector(x), _vector(v), time)

    name = property(lambda self: self._native.name, doc="The name in messages.")
    description = property(lambda self: self._native.description, doc="The description of the file.")
    warnings = property(lambda self: self._native.warnings, doc="What the parser did not know.")
    dimension = property(lambda self: self._native.dimension, doc="2 or 3.")
    integrator = property(lambda self: self._native.integrator, doc="The name of the integrator.")
    options = property(lambda self: self._native.options, doc="The options of the integrator.")
    time_step = property(lambda self: self._native.time_step, doc="In seconds.")
    duration = property(lambda self: self._native.duration, doc="In seconds.")
    n_steps = property(lambda self: self._native.n_steps, doc="Number of steps.")
    positions = property(lambda self: self._native.positions, doc="Initial positions[particle, axis].")
    velocities = property(lambda self: self._native.velocities, doc="Initial velocities[particle, axis].")
    masses = property(lambda self: self._native.masses, doc="Masses[particle].")
    fixed = property(lambda self: self._native.fixed, doc="Whether each particle is fixed.")
    edges = property(lambda self: self._native.edges, doc="The particles of each edge.")
    forces = property(lambda self: self._native.forces, doc="Each force element: kind, particles, parameters by name.")

    def __repr__(self) -> str:
        counts = f"{len(self.masses)} particles, {len(self.edges)} edges, {len(self.forces)} forces"
        return f"Scene({self.integrator}, h = {self.time_step:g} s, {self.n_steps} steps, {self.dimension}D: {counts})"

    def plot(self, ax: Any = None) -> Any:
        """The initial state, by matplotlib: x and y."""
        from . import _plots

        return _plots.scene(self, ax)

    def _repr_html_(self) -> str:
        from . import _html

        kinds: dict[str, int] = {}
        for force in self.forces:
            kinds[force["kind"]] = kinds.get(force["kind"], 0) + 1
        rows = [("integrator", f"{self.integrator}, h = {self.time_step:g} s"), ("steps", str(self.n_steps))]
        rows += [("particles", f"{len(self.masses)}, {int(self.fixed.sum())} fixed"), ("edges", str(len(self.edges)))]
        return _html.table([*rows, *((kind, str(count)) for kind, count in kinds.items())])


@dataclass(frozen=True)
class Trace:
    """The states of a motion: the initial one, and one after each step."""

    times: np.ndarray
    """Times[step], in seconds."""
    positions: np.ndarray
    """Positions[step, particle, axis]."""
    velocities: np.ndarray
    """Velocities[step, particle, axis]."""
    scene: Scene | None = None
    """Its scene, if it is known."""
    has_velocities: bool = True
    """Whether the velocities are the trace's own; else they are derived from positions, or 0."""

    def __len__(self) -> int:
        return len(self.positions)

    def __repr__(self) -> str:
        states, particles, axes = self.positions.shape
        return f"Trace({states} states of {particles} particles in {axes}D, to t = {self.times[-1] if states else 0:g} s)"

    def energies(self) -> tuple[np.ndarray, np.ndarray]:
        """Kinetic and potential energy[step]. The trace must have a scene."""
        if self.scene is None:
            raise ValueError("the energy depends on the scene: load_trace(path, scene)")
        return self.scene._native.energies(_array(self.positions), _array(self.velocities))

    def to_pandas(self) -> Any:
        """A table with the columns of trace files: step, time, x0, y0, vx0, …"""
        import pandas

        states, particles, axes = self.positions.shape
        both = np.concatenate([self.positions, self.velocities], axis=2).reshape(states, -1)
        names = [*"xyz"[:axes], *(f"v{axis}" for axis in "xyz"[:axes])]
        columns = [f"{name}{particle}" for particle in range(particles) for name in names]
        table = pandas.DataFrame(both, columns=columns)
        table.insert(0, "time", self.times)
        table.index.name = "step"
        return table

    def plot(self, ax: Any = None, *, particles: Sequence[int] | None = None) -> Any:
        """The paths of the particles, by matplotlib: x and y."""
        from . import _plots

        return _plots.trajectories(self, ax, particles)

    def plot_energies(self, ax: Any = None) -> Any:
        """Kinetic, potential and total energy over time, by matplotlib."""
        from . import _plots

        return _plots.energies(self, ax)

    def _repr_html_(self) -> str:
        from . import _html

        states, particles, axes = self.positions.shape
        rows = [("states", str(states)), ("particles", f"{particles} in {axes}D")]
        return _html.table([*rows, ("until", f"{self.times[-1] if states else 0:g} s")])


def simulate(scene: Scene, *, robust: bool = False) -> Trace:
    """Simulates a scene. Other threads of Python run meanwhile; Ctrl-C ends it between steps.

    A step that fails raises `SimulationError`; with `robust` it is tried again by damped iterations and shorter steps.
    """
    return Trace(*scene._native.simulate(robust), scene)


def load_trace(path: str | os.PathLike, scene: Scene | None = None, *, format: str | None = None) -> Trace:
    """Reads a trace: `csv` or `fosssim`, by its extension. A binary trace needs its scene, a CSV trace names its columns."""
    native = scene._native if scene else None
    times, positions, velocities, own = _native.read_trace(os.fspath(path), native, format)
    if times is None:
        times = np.arange(len(positions)) * (scene.time_step if scene else 1.0)
    return Trace(times, positions, velocities, scene, own)


@dataclass(frozen=True)
class Comparison:
    """A trace against the oracle's. It is true if the trace passes."""

    verdict: str
    """`pass`, `differs`, `too-short`, `too-long`, `not-finite`, …"""
    message: str
    """The verdict in a sentence."""
    states: int
    """States compared."""
    position: tuple[float, float]
    """The largest residual of a position, and their sum."""
    velocity: tuple[float, float]
    """Those of velocities."""
    first_wrong: dict[str, Any] | None = None
    """The first number out of tolerance: step, time, particle, quantity, axis, expected, got, residual, tolerance."""

    def __bool__(self) -> bool:
        return self.verdict == "pass"

    def __repr__(self) -> str:
        text = f"{self.verdict}: {self.message}\n  {self.states} states; largest residuals {self.position[0]:.1e} and {self.velocity[0]:.1e}"
        if self.first_wrong:
            wrong = self.first_wrong
            text += "\n  step {step} (t = {time:g} s), particle {particle}, {quantity} {axis}: {got!r} for {expected!r}".format(**wrong)
        return text

    def _repr_html_(self) -> str:
        from . import _html

        return _html.block(self.verdict if self else "wrong", repr(self))


def compare(trace: Trace, oracle: Trace, tolerances: tuple[float, float] = COURSE) -> Comparison:
    """Compares a trace with the oracle's by the grader's comparison. `tolerances` are of each residual, and of their sum."""
    step = oracle.scene.time_step if oracle.scene else (oracle.times[1] - oracle.times[0] if len(oracle) > 1 else 1.0)
    got = (_array(trace.positions), _array(trace.velocities) if trace.has_velocities else None)
    expected = (_array(oracle.positions), _array(oracle.velocities))
    return Comparison(**_native.compare(got, expected, float(step), tolerances))
