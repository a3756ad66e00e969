"""Helpers of pytest: each raises AssertionError with the report."""

from __future__ import annotations

import os
from typing import Any, Callable

from ._check import check_gradient, check_hessian, check_jacobian
from ._force import check_force
from ._grade import grade


def _expect(report: Any) -> None:
    __tracebackhide__ = True
    if not report:
        raise AssertionError(repr(report))


def assert_jacobian(f: Callable, jacobian: Callable, x: Any = None, **options: Any) -> None:
    """Asserts that `jacobian` is the derivative of `f`. An inconclusive check fails too."""
    __tracebackhide__ = True
    _expect(check_jacobian(f, jacobian, x, **options))


def assert_gradient(energy: Callable, gradient: Callable, x: Any = None, **options: Any) -> None:
    """Asserts that `gradient` is the derivative of `energy`."""
    __tracebackhide__ = True
    _expect(check_gradient(energy, gradient, x, **options))


def assert_hessian(gradient: Callable, hessian: Callable, x: Any = None, **options: Any) -> None:
    """Asserts that `hessian` is the derivative of `gradient`, and symmetric."""
    __tracebackhide__ = True
    _expect(check_hessian(gradient, hessian, x, **options))


def assert_force(force: Callable, jacobian_x: Callable | None = None, jacobian_v: Callable | None = None, **options: Any) -> None:
    """Asserts that a force follows its law, and that its Jacobians are right."""
    __tracebackhide__ = True
    _expect(check_force(force, jacobian_x, jacobian_v, **options))


def assert_matches_oracle(program: str | os.PathLike, assignment: str | None = None, **options: Any) -> None:
    """Asserts that a program passes every scene that is graded, by the program `grade`."""
    __tracebackhide__ = True
    report = grade(program, assignment, **options)
    if report.failed:
        lines = [f"  {scene['name']}: {scene['message']}" for scene in report.failed[:20]]
        raise AssertionError("\n".join([repr(report), *lines]))
