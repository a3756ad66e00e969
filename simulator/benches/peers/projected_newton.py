#!/usr/bin/env python3
"""Projected Newton for implicit Euler, as a user of numpy and scipy would write it.

    E(x) = 1/2 |x - x~|^2_M + h^2 sum of P_e(x)        x~ = x^n + h v^n
    green:  P_e = l^2 k/2 (|d|^2/l^2 - 1)^2             d = x_i - x_j, l the length at rest
    hooke:  P_e = k/2 (|d| - l)^2

Each step minimises E by Newton's method, each spring's Hessian projected to a positive semi-definite one,
with a backtracking line search. The scene is the elastic square: side 1, density 1000, stretched by 1.4
along x. Cost a Newton iteration: one pass over the springs in Python, one sparse LU.
Source: CMU 15-362 (F24), special topics 4, algorithms 2 and 3; the code is this project's own.

Deviations from the slides:
- Near the minimum E decreases by less than its rounding, and its computed value may rise. The line search
  accepts a rise within that rounding. With the slides' test it may halve until x no longer moves, in each
  iteration anew, and so for ever.
- A tolerance below the rounding of positions is refused, for the same reason.
- The Hookean spring is an option. At length 0 it has no direction, and nothing guards it.
"""
import argparse
import time

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve


def square_mesh(side, n_seg):
    """Nodes by columns from the left, each from below; edges along x, along y, then both diagonals."""
    node = lambda i, j: i * (n_seg + 1) + j
    spacing = side / n_seg
    x = np.array([[-side / 2 + i * spacing, -side / 2 + j * spacing]
                  for i in range(n_seg + 1) for j in range(n_seg + 1)])
    edges = [(node(i, j), node(i + 1, j)) for i in range(n_seg) for j in range(n_seg + 1)]
    edges += [(node(i, j), node(i, j + 1)) for i in range(n_seg + 1) for j in range(n_seg)]
    for i in range(n_seg):
        for j in range(n_seg):
            edges += [(node(i, j), node(i + 1, j + 1)), (node(i + 1, j), node(i, j + 1))]
    return x, edges


class Green:
    """The slides' spring, quadratic in the Green strain."""

    @staticmethod
    def energy(d, l2, k):
        return l2 * 0.5 * k * (d.dot(d) / l2 - 1) ** 2

    @staticmethod
    def gradient(d, l2, k):
        return 2 * k * (d.dot(d) / l2 - 1) * d

    @staticmethod
    def hessian(d, l2, k):
        return 2 * k / l2 * (2 * np.outer(d, d) + (d.dot(d) - l2) * np.identity(2))


class Hooke:
    """The spring that is linear in its length."""

    @staticmethod
    def energy(d, l2, k):
        return 0.5 * k * (np.sqrt(d.dot(d)) - np.sqrt(l2)) ** 2

    @staticmethod
    def gradient(d, l2, k):
        return k * (1 - np.sqrt(l2 / d.dot(d))) * d

    @staticmethod
    def hessian(d, l2, k):
        along = np.outer(d, d) / d.dot(d)
        return k * (along + (1 - np.sqrt(l2 / d.dot(d))) * (np.identity(2) - along))


def make_pd(hessian):
    """The nearest positive semi-definite matrix: negative eigenvalues become 0."""
    eigenvalues, vectors = np.linalg.eigh(hessian)
    return vectors @ np.diag(np.maximum(eigenvalues, 0)) @ vectors.T


class Net:
    """The net, and its incremental potential."""

    def __init__(self, x, edges, mass, k, h, spring):
        self.edges, self.mass, self.k, self.h, self.spring = edges, mass, k, h, spring
        self.rest_squared = [(x[i] - x[j]).dot(x[i] - x[j]) for i, j in edges]

    def springs(self, x):
        for (i, j), l2 in zip(self.edges, self.rest_squared):
            yield i, j, x[i] - x[j], l2

    def energy(self, x, x_tilde):
        inertia = 0.0
        for i in range(len(x)):
            diff = x[i] - x_tilde[i]
            inertia += 0.5 * self.mass * diff.dot(diff)
        elastic = 0.0
        for _, _, d, l2 in self.springs(x):
            elastic += self.spring.energy(d, l2, self.k)
        return inertia + self.h ** 2 * elastic

    def rounding(self, x, x_tilde):
        """How far rounding may shift E: each term's slope times an ulp of the coordinates."""
        slope = 2 * self.mass * np.abs(x - x_tilde).sum()
        for _, _, d, l2 in self.springs(x):
            slope += self.h ** 2 * 2 * np.abs(self.spring.gradient(d, l2, self.k)).sum()
        return np.finfo(float).eps * (np.abs(x).max() * slope + self.energy(x, x_tilde))

    def gradient(self, x, x_tilde):
        elastic = np.zeros_like(x)
        for i, j, d, l2 in self.springs(x):
            g = self.spring.gradient(d, l2, self.k)
            elastic[i] += g
            elastic[j] -= g
        return self.mass * (x - x_tilde) + self.h ** 2 * elastic

    def hessian(self, x):
        size = 2 * len(x)
        rows, columns = list(range(size)), list(range(size))
        values = [self.mass] * size
        for i, j, d, l2 in self.springs(x):
            block = self.spring.hessian(d, l2, self.k)
            local = self.h ** 2 * make_pd(np.block([[block, -block], [-block, block]]))
            unknowns = (2 * i, 2 * i + 1, 2 * j, 2 * j + 1)
            for r in range(4):
                for c in range(4):
                    rows.append(unknowns[r])
                    columns.append(unknowns[c])
                    values.append(local[r, c])
        return sparse.coo_matrix((values, (rows, columns)), shape=(size, size)).tocsr()

    def direction(self, x, x_tilde):
        gradient = self.gradient(x, x_tilde).reshape(-1)
        return spsolve(self.hessian(x), -gradient).reshape(len(x), 2)

    def step(self, x, v, tol):
        """The state a time h later, and the number of updates; the last direction is not applied."""
        x_n, x_tilde, iterations = x, x + v * self.h, 0
        energy = self.energy(x, x_tilde)
        p = self.direction(x, x_tilde)
        while np.abs(p).sum(axis=1).max() / self.h > tol:
            alpha = 1.0
            while (rise := self.energy(x + alpha * p, x_tilde) - energy) > 0:
                if rise <= self.rounding(x, x_tilde):
                    break
                alpha /= 2
            x = x + alpha * p
            energy = self.energy(x, x_tilde)
            p = self.direction(x, x_tilde)
            iterations += 1
        return x, (x - x_n) / self.h, iterations


def row(step, h, x, v):
    """A state as a line of CSV, in the shortest decimals that read back to the same numbers."""
    numbers = [repr(float(value)) for value in np.hstack([x, v]).reshape(-1)]
    return ",".join([str(step), repr(step * h), *numbers]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, kind in [("n_seg", int), ("h", float), ("steps", int), ("k", float), ("tol", float)]:
        parser.add_argument(name, type=kind)
    parser.add_argument("--spring", choices=["green", "hooke"], default="green")
    parser.add_argument("--nudge", type=float, default=0.0, metavar="SIZE",
                        help="move each particle by up to SIZE at the start, to see what rounding does")
    parser.add_argument("--dump", metavar="FILE", help="write the states as CSV")
    args = parser.parse_args()
    if args.tol * args.h < 1e-15:
        parser.error("tol is below the rounding of positions: tol * h must be 1e-15 or more")

    x, edges = square_mesh(1.0, args.n_seg)
    spring = {"green": Green, "hooke": Hooke}[args.spring]
    net = Net(x, edges, 1000.0 / (args.n_seg + 1) ** 2, args.k, args.h, spring)
    x = x * [1.4, 1.0] + np.random.default_rng(1).uniform(-args.nudge, args.nudge, x.shape)
    v = np.zeros_like(x)

    names = ",".join(f"x{i},y{i},vx{i},vy{i}" for i in range(len(x)))
    lines = [f"step,time,{names}\n", row(0, args.h, x, v)]
    seconds, iterations = 0.0, 0
    for step in range(1, args.steps + 1):
        start = time.perf_counter()
        x, v, n_iterations = net.step(x, v, args.tol)
        seconds += time.perf_counter() - start
        iterations += n_iterations
        if args.dump:
            lines.append(row(step, args.h, x, v))
    if args.dump:
        with open(args.dump, "w", encoding="ascii") as file:
            file.writelines(lines)
    steps = max(args.steps, 1)
    print(f"projected_newton n={args.n_seg} particles={len(x)} springs={len(edges)} "
          f"ms_per_step={seconds / steps * 1e3:.4f} "
          f"ns_per_spring_step={seconds / steps / len(edges) * 1e9:.2f} "
          f"iterations={iterations} x0={float(x[0, 0])!r}")


if __name__ == "__main__":
    main()
