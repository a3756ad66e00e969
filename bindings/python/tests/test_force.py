"""Tests of check_force: right and wrong forces of several kinds, at the states of the simulator's own checks."""

import numpy as np
import pytest
import spring_oracle as so
from spring_oracle.testing import assert_force


def spring(x, v, p, sign=1.0):
    half = x.size // 2
    d, w = x[half:] - x[:half], v[half:] - v[:half]
    length = np.sqrt(d @ d)
    n = d / length
    on_second = -sign * (p.k * (length - p.l0) + p.b * (n @ w)) * n
    return np.r_[-on_second, on_second]


def blocks(x, v, p):
    half = x.size // 2
    d, w = x[half:] - x[:half], v[half:] - v[:half]
    length = np.sqrt(d @ d)
    n = d / length
    eye = np.eye(half)
    across = eye - np.outer(n, n)
    by_x = -p.k * (np.outer(n, n) + (length - p.l0) / length * across)
    by_x -= p.b / length * ((n @ w) * eye + np.outer(n, w)) @ across
    return by_x, -p.b * np.outer(n, n)


def spread(block):
    return np.kron([[1, -1], [-1, 1]], block)


def by_x(x, v, p):
    return spread(blocks(x, v, p)[0])


def by_v(x, v, p):
    return spread(blocks(x, v, p)[1])


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_right_spring_is_correct(dimension):
    report = so.check_force(spring, by_x, by_v, kind="spring", dimension=dimension)
    assert report and report.states > 20, report
    assert {of["name"] for of in report.properties} >= {"force", "translation", "rotation"}
    assert_force(spring, by_x, by_v, kind="springforce")


@pytest.mark.parametrize(
    ("wrong_x", "wrong_v", "name"),
    [
        (lambda x, v, p: -by_x(x, v, p), by_v, "exactly the negative"),
        (lambda x, v, p: by_x(x, 0 * v, p), by_v, "dF/dx direct"),
        (by_x, lambda x, v, p: 0 * by_v(x, v, p), "missing"),
        (by_x, lambda x, v, p: by_v(x, v, p) / p.b if p.b else by_v(x, v, p), "factor 1/b too many"),
        (lambda x, v, p: by_x(x, v, p) * (1 + 1e-6), by_v, "relative 1.0e-6"),
    ],
)
def test_a_wrong_jacobian_is_named(wrong_x, wrong_v, name):
    report = so.check_force(spring, wrong_x, wrong_v, kind="spring")
    assert report.verdict == "wrong" and name in repr(report), report
    with pytest.raises(AssertionError, match="wrong"):
        assert_force(spring, wrong_x, wrong_v, kind="spring")


def test_a_gradient_in_place_of_a_force_is_told():
    report = so.check_force(lambda x, v, p: spring(x, v, p, -1.0), by_x, by_v, kind="spring")
    assert report.sign == "gradient" and "gradient of the energy" in repr(report)
    assert "force" in report.wrong and "exactly the negative" in report.likeness


def test_fixed_parameters():
    class P:
        k, l0, b = 9.0, 0.8, 0.7

    fixed = [lambda x, v, of=of: of(x, v, P) for of in (spring, by_x, by_v)]
    plain = [lambda x, v: fixed[0](x, v), lambda x, v: fixed[1](x, v), lambda x, v: fixed[2](x, v)]
    assert so.check_force(*plain, kind="spring", stiffness=9.0, rest_length=0.8, damping=0.7)
    assert so.check_force(*plain, kind="spring", k=9.001, l0=0.8, b=0.7).wrong[0] == "force"
    with pytest.raises(ValueError, match=r"give k, l0"):
        so.check_force(*plain, kind="spring")


def test_an_undamped_spring_with_its_energy():
    energy = lambda x, v, p: 0.5 * p.k * (np.linalg.norm(x[2:] - x[:2]) - p.l0) ** 2
    report = so.check_force(spring, by_x, kind="spring", energy=energy, b=0.0)
    names = {of["name"]: of["verdict"] for of in report.properties}
    assert report and names["gradient"] == names["hessian"] == names["symmetry"] == "correct", report
    half = so.check_force(spring, by_x, kind="spring", energy=lambda x, v, p: 0.5 * energy(x, v, p), b=0.0)
    assert {"gradient", "hessian"} <= set(half.wrong)


def test_forces_of_one_particle_and_between_masses():
    drag = so.check_force(lambda x, v, p: -p.b * v, lambda x, v, p: np.zeros((2, 2)), lambda x, v, p: -p.b * np.eye(2), kind="dragdamping")
    assert drag, drag

    def gravitation(x, v, p):
        d = x[2:] - x[:2]
        on_first = p.G * p.masses[0] * p.masses[1] * d / np.linalg.norm(d) ** 3
        return np.r_[on_first, -on_first]

    assert so.check_force(gravitation, kind="gravitational").verdict == "correct"
    one = lambda x, v, p: gravitation(x, v, p) / p.masses[1]
    assert so.check_force(one, kind="gravitational").wrong == ["force"]


def test_every_kind_can_be_asked_for():
    for of in so.forces():
        zero = lambda x, v, p: np.zeros(x.size)
        assert "force" in so.check_force(zero, kind=of["kind"], dimension=of["least_dimension"], states=2).wrong, of["kind"]
    with pytest.raises(so.SceneError, match="did you mean .springforce"):
        so.check_force(zero, kind="sprinforce")


def test_exceptions_and_shapes():
    def fails(x, v, p):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        so.check_force(fails, kind="spring")
    with pytest.raises(ValueError, match="must be"):
        so.check_force(spring, lambda x, v, p: np.eye(3), kind="spring")


def test_a_picture_of_the_wrong_blocks():
    plt = pytest.importorskip("matplotlib.pyplot", reason="matplotlib is not installed")
    plt.switch_backend("agg")
    axes = so.check_force(spring, lambda x, v, p: -by_x(x, v, p), by_v, kind="spring").plot()
    assert axes.shape == (2, 3)
