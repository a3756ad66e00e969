"""Tests of the Python module."""

import signal
import traceback
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
import spring_oracle as so
from spring_oracle.testing import assert_gradient, assert_jacobian


def f(x):
    return np.array([x[0] * x[1], np.sin(x[1])])


def jacobian(x):
    return np.array([[x[1], x[0]], [0.0, np.cos(x[1])]])


X = [0.7, -1.2]


def test_a_right_jacobian_is_correct():
    report = so.check_jacobian(f, jacobian, X)
    assert report and report.bound < 1e-9 and report.calls[0] < 110
    assert "correct" in repr(report) and "<pre" in report._repr_html_()


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        (lambda x: -jacobian(x), "exactly the negative"),
        (lambda x: jacobian(x).T, "transposed"),
        (lambda x: 0.03 * jacobian(x), "factor h too many"),
        (lambda x: 0 * jacobian(x), "missing"),
    ],
)
def test_a_mistake_is_named(wrong, name):
    report = so.check_jacobian(f, wrong, X, factors={"h": 0.03})
    assert report.verdict == "wrong" and name in report.likeness
    with pytest.raises(AssertionError, match=name):
        assert_jacobian(f, wrong, X, factors={"h": 0.03})


def test_a_force_for_a_gradient_is_the_negative():
    assert_gradient(lambda x: x @ x, lambda x: 2 * x, X)
    assert "exactly the negative" in so.check_gradient(lambda x: x @ x, lambda x: -2 * x, X).likeness
    assert so.check_hessian(lambda x: 2 * x, lambda x: 2 * np.eye(2), X)


def test_sparse_matrices_and_products_are_taken_as_they_are():
    sparse = pytest.importorskip("scipy.sparse")
    n = 400
    x = np.sin(np.arange(n))
    report = so.check_jacobian(lambda x: x**3, lambda x: sparse.diags(3 * x**2), x)
    assert report and report.calls[0] < 100
    assert so.check_jacobian(f, lambda x, v: jacobian(x) @ v, X, products=True)


def test_an_exception_comes_through_with_its_traceback():
    def fails(x):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine") as caught:
        so.check_jacobian(lambda x: f(x) if x[0] == X[0] else fails(x), jacobian, X)
    assert "fails" in "".join(traceback.format_tb(caught.tb))


def test_ctrl_c_ends_a_check():
    def interrupts(x):
        signal.raise_signal(signal.SIGINT)
        return f(x)

    with pytest.raises(KeyboardInterrupt):
        so.check_jacobian(interrupts, jacobian, X)


def test_wrong_shapes_are_said():
    with pytest.raises(ValueError, match="must be"):
        so.check_jacobian(f, lambda x: np.eye(3), X)
    with pytest.raises(ValueError, match="domain"):
        so.check_jacobian(f, jacobian)


def test_the_order_of_methods():
    rate = lambda y: np.array([y[1], -y[0]])
    exact = [np.cos(1.0), -np.sin(1.0)]
    euler = so.check_order(lambda y, h: y + h * rate(y), [1.0, 0.0], exact=exact)
    middle = so.check_order(lambda y, h: y + h * rate(y + 0.5 * h * rate(y)), [1.0, 0.0], exact=exact)
    assert abs(euler.order - 1) < max(0.1, euler.error_bar) and abs(middle.order - 2) < max(0.1, middle.error_bar)


def euler(y, h, zeta=0.0):
    return np.array([y[0] + h * y[1], y[1] - h * (y[0] + 2 * zeta * y[1])])


def symplectic(y, h, zeta=0.0):
    v = y[1] - h * (y[0] + 2 * zeta * y[1])
    return np.array([y[0] + h * v, v])


def implicit(y, h):
    return np.linalg.solve([[1, -h], [h, 1]], y)


def test_the_limit_of_stability_is_that_of_theory():
    for zeta in (0.0, 0.1, 0.7, 1.5):
        report = so.check_stability(lambda y, h: symplectic(y, h, zeta), "symplectic-euler", zeta)
        assert report and "as theory says" in repr(report), (zeta, report)
    assert so.check_stability(lambda y, h: euler(y, h, 0.3), "explicit-euler", 0.3)
    assert so.check_stability(implicit, "implicit-euler").limit == np.inf
    # Damped by the velocity after the step: another limit.
    assert not so.check_stability(lambda y, h: symplectic(y, 1.1 * h), "symplectic-euler")
    assert not so.check_stability(lambda y, h: euler(y, h), "symplectic-euler")
    with pytest.raises(ValueError, match="no integrator"):
        so.check_stability(implicit, "leap-frog")


def test_the_drift_of_energy():
    energy = lambda y: 0.5 * (y @ y)
    bounded = so.check_energy(symplectic, [1.0, 0.3], energy, 0.05)
    assert bounded and 1e-3 < bounded.oscillation < 0.1 and "no drift" in repr(bounded)
    growing = so.check_energy(euler, [1.0, 0.3], energy, 1e-3)
    assert not growing and growing.drift == pytest.approx(1e-3, rel=0.02)
    assert so.check_energy(implicit, [1.0, 0.3], energy, 1e-3).drift < 0


def test_complex_steps_are_one_more_opinion():
    analytic = lambda x: np.array([x[0] * x[1], np.sin(x[1])])
    report = so.check_jacobian(analytic, jacobian, X, complex_step=True)
    assert report and report.complex_step < 1e-15 and "complex step" in repr(report)
    wrong = so.check_jacobian(analytic, lambda x: (1 + 1e-9) * jacobian(x), X, complex_step=True)
    assert wrong.complex_step == pytest.approx(1e-9, rel=1e-3)
    assert so.check_jacobian(f, lambda x, v: jacobian(x) @ v, X, products=True, complex_step=True).complex_step < 1e-15
    with pytest.raises(TypeError, match="complex"):
        so.by_complex_step(lambda x: np.array([x[0].real]), X)


def test_one_version():
    in_c = Path(__file__).parents[2] / "c"
    assert f'#define SO_VERSION "{so.__version__}"' in (in_c / "include/spring_oracle.h").read_text()
    assert f"project(SpringOracle VERSION {so.__version__} " in (in_c / "CMakeLists.txt").read_text()
    crates = [Path(__file__).parents[k] / "Cargo.toml" for k in (1, 3)]
    assert all(f'\nversion = "{so.__version__}"' in crate.read_text() for crate in crates)
    assert version("spring_oracle") == so.__version__


def test_calls_are_counted():
    # Not a call but those that are reported.
    n, calls = 300, []
    report = so.check_jacobian(lambda x: calls.append(0) or x**3, lambda x: np.diag(3 * x**2), np.linspace(0.5, 1.5, n))
    assert report and report.calls[0] in (len(calls), len(calls) - 1)
    print(f"300 x 300 in Python: {report.calls[0]} calls of the function, {report.calls[1]} of the Jacobian")


def test_functions_of_jax_are_taken_as_they_are():
    jax = pytest.importorskip("jax", reason="jax is not installed")
    jax.config.update("jax_enable_x64", True)
    of = lambda x: jax.numpy.stack([x[0] * x[1], jax.numpy.sin(x[1])])
    assert so.check_jacobian(of, jax.jacobian(of), X)


class Mollified:
    """The gradient by displacements of a barrier between two edges, mollified where they are nearly parallel, as a function of the
    positions at rest, which the mollifier's threshold depends on: ipc-toolkit#239, from its description.

    x = X + u, G(X) = f ∇m + m ∇f, m = 2s − s² where s = c/ε(X) < 1, c = |e₁ × e₂|², ε = |E₁|²|E₂|²/1000.
    """

    u = np.zeros(12)
    ends = np.kron([[-1, 1, 0, 0], [0, 0, -1, 1]], np.eye(3))  # both edges of the four points
    middle = np.kron([[-0.5, -0.5, 0.5, 0.5]], np.eye(3))

    def parts(self, rest):
        def cross(at):
            a, b = (self.ends @ at).reshape(2, 3)
            ab, aa, bb = a @ b, a @ a, b @ b
            slope = np.concatenate([2 * bb * a - 2 * ab * b, 2 * aa * b - 2 * ab * a])
            mixed = 4 * np.outer(a, b) - 2 * np.outer(b, a) - 2 * ab * np.eye(3)
            second = np.block([[2 * bb * np.eye(3) - 2 * np.outer(b, b), mixed], [mixed.T, 2 * aa * np.eye(3) - 2 * np.outer(a, a)]])
            return aa * bb - ab * ab, self.ends.T @ slope, self.ends.T @ second @ self.ends

        x = rest + self.u
        c, dc, ddc = cross(x)
        first, second = (self.ends @ rest).reshape(2, 3)
        eps = first @ first * (second @ second) / 1000
        deps = self.ends.T @ np.concatenate([2 * (second @ second) * first, 2 * (first @ first) * second]) / 1000
        s = c / eps if eps > 0 else 1.0
        m, dg, ddg = (2 * s - s * s, 2 - 2 * s, -2.0) if s < 1 else (1.0, 0.0, 0.0)
        eps = eps if s < 1 else 1.0  # of no effect there
        dm, m_eps = dg / eps * dc, -dg * c / eps**2
        ddm = ddg / eps**2 * np.outer(dc, dc) + dg / eps * ddc - np.outer((ddg * c / eps**3 + dg / eps**2) * dc, deps)
        gap = self.middle @ x
        d = 1 + gap @ gap
        f, df = 1 / d, -2 / d**2 * self.middle.T @ gap
        ddf = -2 / d**2 * self.middle.T @ self.middle + 8 / d**3 * np.outer(self.middle.T @ gap, self.middle.T @ gap)
        return f, df, ddf, m, dm, ddm, m_eps, deps

    def value(self, rest):
        f, df, _, m, dm, *_ = self.parts(rest)
        return f * dm + m * df

    def jacobian(self, rest, mistake=0):
        f, df, ddf, m, dm, ddm, m_eps, deps = self.parts(rest)
        threshold = dm if mistake == 1 else deps
        missing = 0.0 if mistake == 2 else np.outer(dm, df)
        return f * ddm + np.outer(df, m_eps * threshold) + np.outer(df, dm) + missing + m * ddf


@pytest.mark.parametrize(("mistake", "verdict"), [(0, "correct"), (1, "wrong"), (2, "wrong")])
def test_the_branch_of_ipc_toolkit_239_is_found(mistake, verdict):
    of = Mollified()
    jacobian = lambda x: of.jacobian(x, mistake)
    box = (-np.ones(12), np.ones(12))
    drawn = so.check_jacobian(of.value, jacobian, domain=box, draws=50, search=False)
    assert drawn.verdict == "correct", "points that are drawn reach the branch"
    report = so.check_jacobian(of.value, jacobian, domain=box, block=3)
    assert report.verdict == verdict and report.on_branch == (mistake > 0), report
    print(report)
    # With displacements, edges are parallel where those at rest are not: no arrangement of the coordinates tells.
    of.u = np.array([0.3, -0.1, 0.2, 0.1, 0.25, -0.2, -0.15, 0.1, 0.3, 0.2, -0.3, 0.1])
    report = so.check_jacobian(of.value, jacobian, domain=box)
    assert report.verdict == verdict and report.on_branch == (mistake > 0), report
    print(report)
