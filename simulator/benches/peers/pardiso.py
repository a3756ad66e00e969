#!/usr/bin/env python3
"""Linearized implicit Euler with MKL PARDISO, as a user of pypardiso would reach for it.

    (M - h^2 dF/dx) (v' - v) = h F        F and dF/dx at x + h v;  x' = x + h v'

The scene is the elastic square: side 1, density 1000, stretched by 1.4 along x, with springs linear in their length.
The matrix is assembled by numpy, in the rows of its upper triangle. The time printed is that of the calls of PARDISO
alone: one analysis of the pattern, then a factorisation and a solution a step, without the assembly.

A matrix that a compressed spring makes indefinite has no Cholesky factor. Such a step takes the LDL^T of PARDISO's type
-2 in its place, with a separate analysis, and is counted. All steps are also taken by type -2 alone; the shorter time of
the two is printed.

    pip install pypardiso          brings MKL
    pardiso.py SEGMENTS TIME_STEP STEPS STIFFNESS
"""
import argparse
import ctypes
import time

import numpy as np
from pypardiso import PyPardisoSolver
from scipy import sparse

ANALYSE, FACTORISE, SOLVE = 11, 22, 33
POSITIVE_DEFINITE, SYMMETRIC = 2, -2


class Net:
    """Positions, springs by the numbers of their ends, rest lengths and the mass of a particle."""

    def __init__(self, n):
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
        self.x = np.stack([i.ravel() / n - 0.5, j.ravel() / n - 0.5], axis=1)
        node = i * (n + 1) + j
        ends = [
            (node[:-1, :], node[1:, :]),
            (node[:, :-1], node[:, 1:]),
            (node[:-1, :-1], node[1:, 1:]),
            (node[1:, :-1], node[:-1, 1:]),
        ]
        self.i = np.concatenate([a.ravel() for a, _ in ends])
        self.j = np.concatenate([b.ravel() for _, b in ends])
        self.rest = np.linalg.norm(self.x[self.i] - self.x[self.j], axis=1)
        self.mass = 1000 / len(self.x)
        self.x[:, 0] *= 1.4


class Pardiso:
    """One pattern: its analysis, and the factors of its matrices."""

    def __init__(self, kind):
        self.solver = PyPardisoSolver(mtype=kind)
        self.seconds, self.factor_seconds, self.operations = 0.0, np.inf, 0.0
        self.analysed = False

    def call(self, phase, rows, columns, values, right, solution):
        solver, pointer = self.solver, ctypes.POINTER(ctypes.c_int32)
        number = lambda value: ctypes.byref(ctypes.c_int32(value))
        numbers = lambda array: array.ctypes.data_as(pointer)
        reals = lambda array: array.ctypes.data_as(ctypes.c_void_p)
        error = ctypes.c_int32(0)
        start = time.perf_counter()
        solver._mkl_pardiso(
            solver.pt.ctypes.data_as(ctypes.POINTER(solver._pt_type[0])), number(1), number(1),
            number(solver.mtype), number(phase), number(len(rows) - 1), reals(values), numbers(rows),
            numbers(columns), numbers(solver.perm), number(1), numbers(solver.iparm), number(0),
            reals(right), reals(solution), ctypes.byref(error))
        seconds = time.perf_counter() - start
        self.seconds += seconds
        return error.value, seconds

    def solve(self, matrix, right):
        """The solution; None where the matrix is not of this type."""
        system = (*matrix, right, np.empty_like(right))
        if not self.analysed:
            # Nested dissection by METIS, operations counted, indices from 0; what is left are the defaults of its type.
            self.solver.iparm[[0, 1, 18, 34]] = 1, 2, -1, 1
            if self.solver.mtype == SYMMETRIC:
                self.solver.iparm[[7, 9, 20]] = 2, 8, 1
            if (error := self.call(ANALYSE, *system)[0]) != 0:
                raise SystemExit(f"error: PARDISO's analysis ended with {error}")
            self.analysed = True
        error, seconds = self.call(FACTORISE, *system)
        if error != 0:
            return None
        self.factor_seconds = min(self.factor_seconds, seconds)
        # PARDISO counts millions of them.
        self.operations = self.solver.iparm[18] * 1e6
        if (error := self.call(SOLVE, *system)[0]) != 0:
            raise SystemExit(f"error: PARDISO's solution ended with {error}")
        return system[-1]


def pattern(net):
    """Rows and columns of the upper triangle, and the place of each entry of the blocks that are added."""
    first, second = np.minimum(net.i, net.j), np.maximum(net.i, net.j)
    particles = np.arange(len(net.x))
    upper = np.array([0, 0, 1]), np.array([0, 1, 1])
    whole = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    block = lambda a, b, axes: ((2 * a[:, None] + axes[0]).ravel(), (2 * b[:, None] + axes[1]).ravel())
    blocks = [block(particles, particles, upper), block(net.i, net.i, upper), block(net.j, net.j, upper),
              block(first, second, whole)]
    rows, columns = (np.concatenate([part[k] for part in blocks]) for k in (0, 1))
    size = 2 * len(net.x)
    keys, places = np.unique(rows * size + columns, return_inverse=True)
    starts = np.searchsorted(keys // size, np.arange(size + 1)).astype(np.int32)
    return starts, (keys % size).astype(np.int32), places


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("segments", type=int)
    parser.add_argument("time_step", type=float)
    parser.add_argument("steps", type=int)
    parser.add_argument("stiffness", type=float)
    options = parser.parse_args()
    # The library is loaded before the clock starts.
    one = np.array([0, 1], np.int32), np.array([0], np.int32), np.ones(1)
    Pardiso(POSITIVE_DEFINITE).solve(one, np.ones(1))
    x, kinds, refused = simulate(options, (POSITIVE_DEFINITE, SYMMETRIC))
    definite = kinds[POSITIVE_DEFINITE]
    seconds = sum(pardiso.seconds for pardiso in kinds.values())
    if refused:
        for pardiso in kinds.values():
            pardiso.solver.free_memory(everything=True)
        _, alone, _ = simulate(options, (SYMMETRIC,))
        seconds = min(seconds, alone[SYMMETRIC].seconds)
    seconds /= options.steps
    springs = 4 * options.segments ** 2 + 2 * options.segments
    print(f"springs={springs} ms_per_step={seconds * 1e3:.4f} ns_per_spring_step={seconds / springs * 1e9:.3f} "
          f"x0={x[0, 0]:.17g} refused={refused} factor_ms={definite.factor_seconds * 1e3:.4f} "
          f"factor_flops={definite.operations:.6g}")


def simulate(options, types):
    """Positions at the end, the factors by type, and the number of matrices that the first type refused."""
    net, h, k = Net(options.segments), options.time_step, options.stiffness
    x, v = net.x, np.zeros_like(net.x)
    rows, columns, places = pattern(net)
    kinds = {}
    refused = 0
    for _ in range(options.steps):
        y = x + h * v
        d = y[net.i] - y[net.j]
        length = np.linalg.norm(d, axis=1)
        n = d / length[:, None]
        pull = (k * (length - net.rest))[:, None] * n
        force = np.zeros_like(x)
        for axis in range(2):
            force[:, axis] -= np.bincount(net.i, pull[:, axis], len(x))
            force[:, axis] += np.bincount(net.j, pull[:, axis], len(x))
        strain = (length - net.rest) / length
        outer = n[:, :, None] * n[:, None, :]
        stiffness = h * h * k * (outer + strain[:, None, None] * (np.eye(2) - outer))
        half = stiffness[:, [0, 0, 1], [0, 1, 1]].ravel()
        masses = np.tile([net.mass, 0, net.mass], len(x))
        entries = np.concatenate([masses, half, half, -stiffness.reshape(-1)])
        matrix = rows, columns, np.bincount(places, entries, len(columns))
        right = h * force.ravel()
        change = None
        for kind in types:
            change = kinds.setdefault(kind, Pardiso(kind)).solve(matrix, right)
            if change is not None:
                break
            refused += 1
        if change is None:
            raise SystemExit("error: PARDISO factorises a matrix by neither type")
        v = v + change.reshape(-1, 2)
        x = x + h * v
    return x, kinds, refused


if __name__ == "__main__":
    main()
