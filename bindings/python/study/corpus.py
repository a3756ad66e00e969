"""Functions with Jacobians: 300 with a planted mistake, and 150 that are right but hard.

Every function is written twice: its values, and its Jacobian by hand. The mistakes were written before the check was tuned.

Shapes: `x` has n numbers, `f(x)` m numbers, `jac(x)` is m × n. Coordinates of particles are particle-major.
"""

from dataclasses import dataclass, field, replace
from typing import Callable

import numpy as np

H, MASS = 0.03, 1.7  # a time step and a mass, whose factors are planted


@dataclass(frozen=True)
class Function:
    """A function with its Jacobian, and the box of its arguments."""

    name: str
    f: Callable
    jac: Callable
    lower: np.ndarray
    upper: np.ndarray
    block: int = 1
    switch: Callable | None = None  # x -> whether the rarer branch is active
    hard: str = ""  # why it is hard

    @property
    def n(self):
        return self.lower.size


@dataclass(frozen=True)
class Mistake:
    """A function whose Jacobian is wrong, and how."""

    function: Function
    kind: str
    name: str = field(default="")


def box(n, low=-1.0, high=1.0):
    return np.full(n, low), np.full(n, high)


def pairs_force(n, d, pairs, law):
    """Sum of forces between pairs; `law(d, k)` is the force on the second particle and its derivative by d."""

    def f(x):
        p = x.reshape(n, d)
        out = np.zeros((n, d))
        for k, (i, j) in enumerate(pairs):
            force, _ = law(p[j] - p[i], k)
            out[j] += force
            out[i] -= force
        return out.ravel()

    def jac(x):
        p = x.reshape(n, d)
        out = np.zeros((n, d, n, d))
        for k, (i, j) in enumerate(pairs):
            _, block = law(p[j] - p[i], k)
            out[j, :, j] += block
            out[i, :, i] += block
            out[j, :, i] -= block
            out[i, :, j] -= block
        return out.reshape(n * d, n * d)

    return f, jac


def hooke(stiffness, rest):
    def law(d, k):
        length = np.sqrt(d @ d)
        unit = d / length
        stretch = (length - rest) / length
        eye = np.eye(d.size)
        block = np.outer(unit, unit) + stretch * (eye - np.outer(unit, unit))
        s = stiffness * (1 + 0.3 * k)
        return -s * (length - rest) * unit, -s * block

    return law


def many_springs(name, n, d, pairs, stiffness, rest, spread=1.5):
    """`hooke` between many pairs, by whole arrays."""
    i, j = np.array(pairs).T
    s = stiffness * (1 + 0.3 * np.arange(len(pairs)))

    def parts(x):
        p = x.reshape(n, d)
        line = p[j] - p[i]
        length = np.sqrt((line * line).sum(1))
        return line / length[:, None], length

    def f(x):
        unit, length = parts(x)
        force = (-s * (length - rest))[:, None] * unit
        out = np.zeros((n, d))
        np.add.at(out, j, force)
        np.add.at(out, i, -force)
        return out.ravel()

    def jac(x):
        unit, length = parts(x)
        outer = unit[:, :, None] * unit[:, None, :]
        stretch = ((length - rest) / length)[:, None, None]
        block = -s[:, None, None] * (outer + stretch * (np.eye(d) - outer))
        out = np.zeros((n, n, d, d))
        for a, b, sign in ((j, j, 1), (i, i, 1), (j, i, -1), (i, j, -1)):
            np.add.at(out, (a, b), sign * block)
        return out.transpose(0, 2, 1, 3).reshape(n * d, n * d)

    return Function(name, f, jac, *box(n * d, -spread, spread), block=d)


def green(stiffness, rest):
    def law(d, _):
        excess = d @ d - rest * rest
        return -stiffness * excess * d, -stiffness * (2 * np.outer(d, d) + excess * np.eye(d.size))

    return law


def gravitation(strength):
    def law(d, _):
        square = d @ d
        cube = square ** 1.5
        return -strength * d / cube, -strength * (np.eye(d.size) / cube - 3 * np.outer(d, d) / (square * cube))

    return law


def vortex(strength):
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])

    def law(d, _):
        square = d @ d
        return strength * turn @ d / square, strength * (turn / square - 2 * np.outer(turn @ d, d) / square**2)

    return law


def tension_only(stiffness, rest):
    law = hooke(stiffness, rest)

    def clamped(d, k):
        force, block = law(d, k)
        return (force, block) if d @ d > rest * rest else (0 * force, 0 * block)

    return clamped


def barrier(strength, reach):
    """The gradient of −(s − r)² ln(s / r) in the distance s, below the reach r."""

    def law(d, _):
        s = np.sqrt(d @ d)
        if s >= reach:
            return np.zeros(d.size), np.zeros((d.size, d.size))
        unit = d / s
        first = strength * (-2 * (s - reach) * np.log(s / reach) - (s - reach) ** 2 / s)
        second = strength * (-2 * np.log(s / reach) - 4 * (s - reach) / s + (s - reach) ** 2 / s**2)
        eye = np.eye(d.size)
        block = second * np.outer(unit, unit) + first / s * (eye - np.outer(unit, unit))
        return -first * unit, -block

    return law


def between_particles(name, n, d, pairs, law, spread=1.5, switch=None):
    f, jac = pairs_force(n, d, pairs, law)
    return Function(name, f, jac, *box(n * d, -spread, spread), block=d, switch=switch)


def chain(n):
    return [(i, i + 1) for i in range(n - 1)]


def distance_below(pairs, d, reach):
    def switch(x):
        p = x.reshape(-1, d)
        return any(np.linalg.norm(p[j] - p[i]) < reach for i, j in pairs)

    return switch


def implicit(base, mass, h):
    """The residual of implicit Euler in the velocity: m v − h F(q + h v)."""
    rng = np.random.default_rng(7)
    q = rng.uniform(base.lower, base.upper)
    return Function(
        f"implicit Euler, {base.name}",
        lambda v: mass * v - h * base.f(q + h * v),
        lambda v: mass * np.eye(v.size) - h * h * base.jac(q + h * v),
        *box(base.n),
        block=base.block,
    )


def network(n, hidden, m):
    rng = np.random.default_rng(3)
    a, b, c = rng.normal(size=(hidden, n)), rng.normal(size=hidden), rng.normal(size=(m, hidden))
    return Function(
        f"network {n}-{hidden}-{m}",
        lambda x: c @ np.tanh(a @ x + b),
        lambda x: c @ ((1 - np.tanh(a @ x + b) ** 2)[:, None] * a),
        *box(n),
    )


def rosenbrock(n):
    def f(x):
        out = np.zeros(n)
        gap = x[1:] - x[:-1] ** 2
        out[1:] += 200 * gap
        out[:-1] += -400 * gap * x[:-1] - 2 * (1 - x[:-1])
        return out

    def jac(x):
        out = np.zeros((n, n))
        k = np.arange(n - 1)
        out[k + 1, k + 1] += 200
        out[k + 1, k] += -400 * x[:-1]
        out[k, k] += -400 * (x[1:] - 3 * x[:-1] ** 2) + 2
        out[k, k + 1] += -400 * x[:-1]
        return out

    return Function(f"Rosenbrock {n}", f, jac, *box(n, -2, 2))


def double_pendulum():
    def f(x):
        a, b, u, v = x
        s, c = np.sin(a - b), np.cos(a - b)
        bottom = 2 - c * c
        return np.array([u, v, (-s * (v * v + u * u * c) - 2 * np.sin(a)) / bottom, (2 * s * u * u + np.sin(b)) / bottom])

    def jac(x):
        a, b, u, v = x
        s, c = np.sin(a - b), np.cos(a - b)
        bottom, slope = 2 - c * c, 2 * c * s
        top = -s * (v * v + u * u * c) - 2 * np.sin(a)
        by_angle = -c * (v * v + u * u * c) + s * s * u * u
        other = 2 * s * u * u + np.sin(b)
        out = np.zeros((4, 4))
        out[0, 2] = out[1, 3] = 1
        out[2, 0] = (by_angle - 2 * np.cos(a)) / bottom - top * slope / bottom**2
        out[2, 1] = -by_angle / bottom + top * slope / bottom**2
        out[2, 2], out[2, 3] = -2 * s * u * c / bottom, -2 * s * v / bottom
        out[3, 0] = 2 * c * u * u / bottom - other * slope / bottom**2
        out[3, 1] = (-2 * c * u * u + np.cos(b)) / bottom + other * slope / bottom**2
        out[3, 2] = 4 * s * u / bottom
        return out

    return Function("double pendulum", f, jac, *box(4, -2, 2))


def friction():
    """A smoothed friction force, constant beyond the threshold 0.3."""

    def f(x):
        speed, e = np.sqrt(x @ x), 0.3
        return -x / speed if speed > e else -x * (2 / e - speed / e**2)

    def jac(x):
        speed, e = np.sqrt(x @ x), 0.3
        outer = np.outer(x, x)
        if speed > e:
            return -np.eye(2) / speed + outer / speed**3
        return -np.eye(2) * (2 / e - speed / e**2) + outer / (speed * e**2)

    return Function("friction", f, jac, *box(2, -2, 2), block=2, switch=lambda x: np.sqrt(x @ x) < 0.3)


def huber(n):
    rng = np.random.default_rng(5)
    a = rng.normal(size=(n, n))
    return Function(
        f"Huber {n}",
        lambda x: np.where(np.abs(a @ x) < 0.05, a @ x * 20, np.sign(a @ x)),
        lambda x: np.where(np.abs(a @ x) < 0.05, 20.0, 0.0)[:, None] * a,
        *box(n, -2, 2),
        switch=lambda x: bool((np.abs(a @ x) < 0.05).any()),
    )


def smooth_functions():
    """Functions in which mistakes are planted; symmetric and not, square and not, 2 to 300 variables."""
    springs3 = between_particles("springs in space", 5, 3, chain(5) + [(0, 3)], hooke(9, 0.8))
    springs2 = between_particles("springs in the plane", 4, 2, chain(4), hooke(5, 0.6))
    return [
        springs3,
        springs2,
        many_springs("100 particles", 100, 3, chain(100) + [(0, 50)], 20, 0.7),
        between_particles("squared springs", 4, 3, chain(4), green(3, 0.9)),
        between_particles("gravitation", 4, 2, [(0, 1), (1, 2), (0, 3)], gravitation(1.3)),
        between_particles("vortices", 4, 2, [(0, 1), (1, 2), (2, 3)], vortex(0.9)),
        implicit(springs3, 1.3, 0.1),
        network(6, 9, 6),
        network(9, 12, 5),
        rosenbrock(8),
        double_pendulum(),
    ]


def branched_functions():
    """Functions with a branch that few arguments reach."""
    pairs, spread = [(0, 1), (1, 2), (0, 2)], 2.0
    return [
        between_particles("barrier 0.3", 3, 2, pairs, barrier(4, 0.3), spread, distance_below(pairs, 2, 0.3)),
        between_particles("barrier 0.1", 3, 2, pairs, barrier(4, 0.1), spread, distance_below(pairs, 2, 0.1)),
        between_particles("barrier 0.2 in space", 3, 3, pairs, barrier(4, 0.2), spread, distance_below(pairs, 3, 0.2)),
        between_particles("tension only", 3, 2, pairs[:2], tension_only(7, 0.5), spread, distance_below(pairs[:2], 2, 0.5)),
        friction(),
        huber(4),
    ]


def rows_of(function, a):
    return slice(a * function.block, (a + 1) * function.block)


def two_blocks(j, block, rng):
    """Two different blocks, both with entries, whose columns and rows differ."""
    count = j.shape[1] // block
    blocks = list(range(min(count, j.shape[0] // block)))
    rng.shuffle(blocks)
    return blocks[0], blocks[1]


def plant(function, kind, seed):
    """The function with a mistake of this kind in its Jacobian; `None` where that would be no mistake."""
    rng = np.random.default_rng(seed)
    right, b = function.jac, max(function.block, 1)
    at = rng.uniform(function.lower, function.upper)
    j0 = right(at)
    square = j0.shape[0] == j0.shape[1]
    place = tuple(rng.choice(np.argwhere(np.abs(j0) > 1e-3 * np.abs(j0).max())))

    def edited(edit):
        def jac(x):
            j = right(x).copy()
            edit(j, x)
            return j

        return jac

    def scale(factor):
        return lambda x: factor * right(x)

    def block_at():
        row, column = place[0] // b, place[1] // b
        return np.s_[row * b : (row + 1) * b, column * b : (column + 1) * b]

    def swap_columns(j, _):
        p, q = two_blocks(j, b, np.random.default_rng(seed))
        p, q = slice(p * b, p * b + b), slice(q * b, q * b + b)
        j[:, p], j[:, q] = j[:, q].copy(), j[:, p].copy()

    def swap_rows(j, _):
        p, q = two_blocks(j, b, np.random.default_rng(seed))
        p, q = slice(p * b, p * b + b), slice(q * b, q * b + b)
        j[p], j[q] = j[q].copy(), j[p].copy()

    def entry(j, _):
        j[place] *= 1 + 1e-6

    def missing(j, _):
        j[block_at()] = 0

    def negated_block(j, _):
        j[block_at()] *= -1

    def transposed_block(j, _):
        j[block_at()] = j[block_at()].T.copy()

    def only_diagonal(j, _):
        j[...] = np.diag(np.diag(j))

    def only_triangle(j, _):
        j[...] = np.tril(j)

    def missing_row(j, _):
        j[place[0]] = 0

    def missing_column(j, _):
        j[:, place[1]] = 0

    def direction(j, _):
        g = np.random.default_rng(seed)
        u, v = g.normal(size=j.shape[0]), g.normal(size=j.shape[1])
        j += 1e-4 * np.abs(j).max() * np.outer(u, v) / (np.linalg.norm(u) * np.linalg.norm(v))

    kinds = {
        "negative": scale(-1),
        "transposed": (lambda x: right(x).T) if square else None,
        "factor ½": scale(0.5),
        "factor 2": scale(2),
        "factor h": scale(H),
        "factor h²": scale(H * H),
        "factor m": scale(MASS),
        "zero": scale(0),
        "symmetrised": (lambda x: 0.5 * (right(x) + right(x).T)) if square else None,
        "columns exchanged": edited(swap_columns),
        "rows exchanged": edited(swap_rows),
        "one entry": edited(entry),
        "block missing": edited(missing) if b > 1 else None,
        "block negated": edited(negated_block) if b > 1 else None,
        "block transposed": edited(transposed_block) if b > 1 else None,
        "row missing": edited(missing_row),
        "column missing": edited(missing_column),
        "only the diagonal": edited(only_diagonal) if square else None,
        "only one triangle": edited(only_triangle) if square else None,
        "one direction": edited(direction),
        "another point": lambda x: right(at),
    }
    jac = kinds[kind]
    if jac is None:
        return None
    # A transposed symmetric matrix is right.
    others = [rng.uniform(function.lower, function.upper) for _ in range(3)]
    if all(np.allclose(jac(x), right(x), rtol=1e-9, atol=1e-12) for x in others):
        return None
    return Mistake(replace(function, jac=jac), kind, f"{function.name}: {kind}")


KINDS = [
    "negative", "transposed", "factor ½", "factor 2", "factor h", "factor h²", "factor m", "zero", "symmetrised",
    "columns exchanged", "rows exchanged", "one entry", "block missing", "block negated", "block transposed", "row missing",
    "column missing", "only the diagonal", "only one triangle", "one direction", "another point",
]  # fmt: skip


def plant_in_branch(function, kind, seed):
    """The same, on the rarer branch alone."""
    wrong = {"negative": -1.0, "factor ½": 0.5, "zero": 0.0, "a millionth": 1 + 1e-6, "factor 2": 2.0}[kind]
    right, switch = function.jac, function.switch
    jac = lambda x: (wrong if switch(x) else 1.0) * right(x)
    return Mistake(replace(function, jac=jac), f"one branch, {kind}", f"{function.name}: one branch, {kind}")


def mistakes(count=300):
    """The planted mistakes: every kind in every function, and five in each branch, twice."""
    found = []
    for function in branched_functions():
        for seed, kind in enumerate(["negative", "factor ½", "a millionth", "factor 2"] + ["zero"] * (function.name != "tension only")):
            found.append(plant_in_branch(function, kind, seed))
    seed = 0
    while len(found) < count:
        for function in smooth_functions():
            for kind in KINDS:
                seed += 1
                # The largest function is slow in Python: one entry of 300 × 300, and a few others.
                if function.n == 300 and kind not in ("one entry", "transposed", "block missing", "one direction", "columns exchanged"):
                    continue
                mistake = plant(function, kind, seed)
                if mistake and len(found) < count:
                    found.append(mistake)
    return found


def stiff(k):
    """Springs a thousand to a billion times stiffer than others."""
    ratio = 10.0 ** (3 + k % 7)
    pairs = chain(3)
    law = hooke(1.0, 0.8)
    scaled = lambda d, i: tuple(part * (ratio if i else 1.0) for part in law(d, i))
    return replace(between_particles(f"stiffness ratio {ratio:.0e}", 3, 2, pairs, scaled), hard="stiff")


def layer(k):
    width = 10.0 ** -(2 + k % 5)
    f = lambda x: np.array([np.tanh(x[0] / width) + x[1], x[0] * x[1]])
    jac = lambda x: np.array([[(1 - np.tanh(x[0] / width) ** 2) / width, 1.0], [x[1], x[0]]])
    return Function(f"layer of width {width:.0e}", f, jac, *box(2, -3 * width, 3 * width), hard="stiff")


def single(base):
    """The whole function in single precision, as a program on a GPU computes it."""

    def of(function):
        return lambda x: np.asarray(function(x.astype(np.float32).astype(np.float64)), dtype=np.float32).astype(np.float64)

    return replace(base, name=f"{base.name} in single precision", f=of(base.f), jac=of(base.jac), hard="single precision")


def single_throughout(n, seed):
    a = np.random.default_rng(seed).normal(size=(n, n)).astype(np.float32)
    f = lambda x: np.sin(a @ x.astype(np.float32)).astype(np.float64)
    jac = lambda x: (np.cos(a @ x.astype(np.float32))[:, None] * a).astype(np.float64)
    return Function(f"sines in single precision {n}", f, jac, *box(n), hard="single precision")


def noisy(n, level, seed):
    """Every value with a deterministic error of this size, as an iteration that stops early leaves it."""
    a = np.random.default_rng(seed).normal(size=(n, n))

    def f(x):
        y = np.sin(a @ x)
        return y + level * np.sin(1e15 * (y + a @ x))

    return Function(f"noise {level:.0e}", f, lambda x: np.cos(a @ x)[:, None] * a, *box(n), hard="noise")


def kinked(n, seed):
    a = np.random.default_rng(seed).normal(size=(n, n))
    return Function(
        f"absolute values {n}",
        lambda x: np.abs(a @ x) + (a @ x) ** 2,
        lambda x: (np.sign(a @ x) + 2 * (a @ x))[:, None] * a,
        *box(n),
        hard="kink",
    )


def at_kink(n):
    """|x| on a box whose centre and corners lie on kinks."""
    return Function(
        f"at kinks {n}", lambda x: np.maximum(x, 0) + x**3, lambda x: np.diag((x > 0) + 3 * x**2), *box(n, 0, 1), hard="kink"
    )


def jump(n, seed):
    a = np.random.default_rng(seed).normal(size=(n, n))
    return Function(
        f"steps {n}", lambda x: np.floor(3 * (a @ x)) + (a @ x) ** 2, lambda x: 2 * (a @ x)[:, None] * a, *box(n), hard="jump"
    )


def near_singular(k):
    power = 10.0 ** -(3 + k)
    f = lambda x: np.array([1 / x[0] + x[1], np.sqrt(x[0]) * x[1], np.log(x[0])])
    jac = lambda x: np.array([[-1 / x[0] ** 2, 1], [0.5 * x[1] / np.sqrt(x[0]), np.sqrt(x[0])], [1 / x[0], 0]])
    return Function(f"pole at distance {power:.0e}", f, jac, np.array([power, -1.0]), np.array([10 * power, 1.0]), hard="nearly singular")


def short_spring(k):
    length = 10.0 ** -(2 + k % 5)
    base = between_particles(f"spring of length {length:.0e}", 2, 3, [(0, 1)], hooke(3, 1.0))
    return replace(base, lower=np.r_[base.lower[:3], 0, 0, 0] * length, upper=base.upper * length + np.r_[0, 0, 0, length, 0, 0],
                   hard="nearly singular")  # fmt: skip


def far(k):
    offset = 10.0 ** (2 + k % 5)
    base = between_particles(f"springs {offset:.0e} from the origin", 3, 2, chain(3), hooke(4, 0.9))
    return replace(base, lower=base.lower + offset, upper=base.upper + offset, hard="cancellation")


def chaotic(steps):
    """The logistic map iterated, with the product of its slopes."""

    def f(x):
        y = x.copy()
        for _ in range(steps):
            y = 3.99 * y * (1 - y)
        return y

    def jac(x):
        y, slope = x.copy(), np.ones_like(x)
        for _ in range(steps):
            slope *= 3.99 * (1 - 2 * y)
            y = 3.99 * y * (1 - y)
        return np.diag(slope)

    return Function(f"logistic map, {steps} steps", f, jac, *box(2, 0.1, 0.9), hard="chaotic")


def oscillating(k):
    rate = 10.0 ** (1 + k % 6)
    f = lambda x: np.array([np.sin(rate * x[0]) / rate + x[1], np.cos(rate * x[1])])
    jac = lambda x: np.array([[np.cos(rate * x[0]), 1], [0, -rate * np.sin(rate * x[1])]])
    return Function(f"sine of rate {rate:.0e}", f, jac, *box(2), hard="oscillating")


def polynomial_tail(k):
    """A huge constant with a small slope: few digits are left for the derivative."""
    large = 10.0 ** (2 + k)
    return Function(
        f"constant {large:.0e}", lambda x: large + np.array([x[0] * x[1], x[0] - x[1]]),
        lambda x: np.array([[x[1], x[0]], [1.0, -1.0]]), *box(2), hard="cancellation",
    )  # fmt: skip


def rights():
    """150 right but hard functions."""
    found = smooth_functions() + branched_functions()
    found = [replace(each, hard=each.hard or ("branches" if each.switch else "none")) for each in found]
    found += [stiff(k) for k in range(7)] + [layer(k) for k in range(5)]
    found += [single(each) for each in smooth_functions() if each.n < 100]
    found += [single_throughout(n, n) for n in range(2, 12)]
    found += [noisy(3, 10.0**-level, level) for level in range(4, 14)]
    found += [kinked(n, n) for n in range(1, 11)] + [at_kink(n) for n in range(1, 6)] + [jump(n, n) for n in range(1, 6)]
    found += [near_singular(k) for k in range(8)] + [short_spring(k) for k in range(5)] + [far(k) for k in range(5)]
    found += [chaotic(steps) for steps in range(5, 60, 5)]
    found += [oscillating(k) for k in range(6)] + [polynomial_tail(k) for k in range(8)]
    # The remaining ones: the smooth functions again, in units of a billionth and of a billion.
    for unit in (1e-9, 1e9, 1e-3, 1e4):
        for each in smooth_functions():
            if each.n < 100 and len(found) < 150:
                f, jac = each.f, each.jac
                found.append(replace(
                    each, name=f"{each.name} in units of {unit:.0e}", f=lambda x, f=f, u=unit: f(x / u),
                    jac=lambda x, j=jac, u=unit: j(x / u) / u, lower=each.lower * unit, upper=each.upper * unit, hard="units",
                ))  # fmt: skip
    return found
