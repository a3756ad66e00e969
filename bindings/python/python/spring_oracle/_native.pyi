from typing import Any, Callable, Sequence

import numpy as np

__version__: str

class SceneError(ValueError): ...
class TraceError(ValueError): ...
class SimulationError(RuntimeError): ...

class Scene:
    name: str
    description: str | None
    warnings: list[str]
    dimension: int
    integrator: str
    options: dict[str, float | int | str]
    time_step: float
    duration: float
    n_steps: int
    positions: np.ndarray
    velocities: np.ndarray
    masses: np.ndarray
    fixed: np.ndarray
    edges: list[tuple[int, int]]
    forces: list[dict[str, Any]]
    def __init__(self, integrator: str, time_step: float, duration: float, dimension: int, options: dict[str, Any]) -> None: ...
    @staticmethod
    def read(path: str, strict: bool) -> Scene: ...
    @staticmethod
    def parse(text: str, name: str, strict: bool) -> Scene: ...
    def changed(
        self, integrator: str | None, time_step: float | None, duration: float | None, options: dict[str, Any]
    ) -> Scene: ...
    def particle(self, position: Sequence[float], velocity: Sequence[float], mass: float, fixed: bool) -> int: ...
    def edge(self, i: int, j: int) -> int: ...
    def force(self, tag: str, given: dict[str, Any]) -> int: ...
    def xml(self) -> str: ...
    def simulate(self, robust: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...
    def energies(self, positions: np.ndarray, velocities: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...
    def laws(self, x: np.ndarray, v: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...

def check_jacobian(
    value: Callable[..., Any], jacobian: Callable[..., Any], kind: str, shape: tuple[int, int], settings: dict[str, Any]
) -> dict[str, Any]: ...
def check_force(
    force: Callable[..., Any],
    jacobians: tuple[Callable[..., Any] | None, Callable[..., Any] | None],
    energy: Callable[..., Any] | None,
    kind: str,
    dimension: int,
    parameters: dict[str, float],
    masses: Sequence[float],
    settings: tuple[int, int],
) -> dict[str, Any]: ...
def forces() -> list[dict[str, Any]]:
    """The kinds of force: kind, title, formula, attributes of particles, parameters."""

def integrators() -> list[tuple[str, str]]:
    """The names of the integrators, with their summaries."""

def stable_steps(integrator: str, damping_ratio: float) -> tuple[float, float]:
    """The stable steps on an oscillator, in units of 1/ω: up to the first, and again from the second on."""

def read_trace(
    path: str, scene: Scene | None, format: str | None
) -> tuple[np.ndarray | None, np.ndarray, np.ndarray, bool]: ...
def compare(
    got: tuple[np.ndarray, np.ndarray | None],
    oracle: tuple[np.ndarray, np.ndarray],
    time_step: float,
    tolerances: tuple[float, float],
) -> dict[str, Any]: ...
