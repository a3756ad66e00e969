"""Tests of the Python module."""

import signal
import traceback

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


def test_one_version():
    assert so.__version__ == "0.2.0"


def test_functions_of_jax_are_taken_as_they_are():
    jax = pytest.importorskip("jax", reason="jax is not installed")
    jax.config.update("jax_enable_x64", True)
    of = lambda x: jax.numpy.stack([x[0] * x[1], jax.numpy.sin(x[1])])
    assert so.check_jacobian(of, jax.jacobian(of), X)
