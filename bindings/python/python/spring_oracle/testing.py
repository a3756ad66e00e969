"""Helpers of pytest: each raises AssertionError with the report."""

from __future__ import annotations

from typing import Any, Callable

from ._check import check_gradient, check_jacobian


def assert_jacobian(f: Callable, jacobian: Callable, x: Any = None, **options: Any) -> None:
    """Asserts that `jacobian` is the derivative of `f`. An inconclusive check fails too."""
    __tracebackhide__ = True
    report = check_jacobian(f, jacobian, x, **options)
    if not report:
        raise AssertionError(str(report))


def assert_gradient(energy: Callable, gradient: Callable, x: Any = None, **options: Any) -> None:
    """Asserts that `gradient` is the derivative of `energy`."""
    __tracebackhide__ = True
    report = check_gradient(energy, gradient, x, **options)
    if not report:
        raise AssertionError(str(report))
