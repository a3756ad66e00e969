"""A mass-spring simulator in Python's standard library, in two or three dimensions.

Called as ours is: student.py scene.xml -o trace.csv. Its forces are differentiated by hand, its matrix is a list
of lists of connected parts, each solved by Gauss's elimination. Elements that it does not know are passed over.
MISTAKE, in the environment or as two last arguments `-e MISTAKE=name`, plants one mistake by its name.
"""

import math
import os
import sys
import xml.etree.ElementTree as ElementTree

MISTAKE = os.environ.get("MISTAKE", "")
if sys.argv[4:5] == ["-e"]:
    MISTAKE = sys.argv[5].partition("=")[2]

# The methods have shorter names as well.
FULL = {
    "symplectic": "symplectic-euler",
    "forward-backward-euler": "symplectic-euler",
    "linearized-implicit": "linearized-implicit-euler",
}


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def identity(scale, size):
    return [[scale if r == c else 0.0 for c in range(size)] for r in range(size)]


def outer(scale, a, b):
    return [[scale * p * q for q in b] for p in a]


def plus(*blocks):
    return [[sum(entries) for entries in zip(*rows)] for rows in zip(*blocks)]


def scaled(factor, block):
    return [[factor * entry for entry in row] for row in block]


def turn(vector):
    return [-vector[1], vector[0]] + [0.0] * (len(vector) - 2)


def spring(d, w, k, l0, b):
    """Force on the first particle, its derivatives by d and by w."""
    # In one place, only a spring with l0 = b = 0 has a force.
    size, length = len(d), math.sqrt(dot(d, d)) or 1.0
    n = [c / length for c in d]
    rate = dot(n, w)
    force = [-(k * (length - l0) + b * rate) * c for c in n]
    # n changes by (I - n n^T)/length, the rate by that times w.
    across = plus(identity(1.0, size), outer(-1.0, n, n))
    swing = [dot(row, w) / length for row in across]
    tension = k * (length - l0) + b * rate
    by_x = plus(outer(-k, n, n), outer(-b, n, swing), scaled(-tension / length, across))
    if MISTAKE == "n and its change swapped":
        by_x = plus(outer(-k, n, n), outer(-b, swing, n), scaled(-tension / length, across))
    by_v = outer(-b, n, n)
    if MISTAKE == "dF/dv off by 1e-6":
        by_v = outer(-b * (1 + 1e-6), n, n)
    return force, by_x, by_v


def gravitation(d, strength):
    size, length = len(d), math.sqrt(dot(d, d))
    force = [-strength / length**3 * c for c in d]
    by_x = plus(identity(-strength / length**3, size), outer(3 * strength / length**5, d, d))
    if MISTAKE == "l⁴ for l⁵ in gravitation":
        by_x = plus(identity(-strength / length**3, size), outer(3 * strength / length**4, d, d))
    return force, by_x, identity(0.0, size)


def vortex(d, w, kbs, kvc):
    size, squared = len(d), dot(d, d)
    length = math.sqrt(squared)
    turned = turn(d)
    force = [kvc / squared * (kbs * t / length - c) for t, c in zip(turned, w)]
    axes = [[1.0 if r == c else 0.0 for c in range(size)] for r in range(size)]
    columns = [turn(axis) for axis in axes]
    quarter = [[columns[c][r] for c in range(size)] for r in range(size)]
    if size == 3:
        # The turn is about the z axis, and leaves z alone.
        quarter[2][2] = 1.0
        force[2] += kvc * kbs * d[2] / length**3
        turned = turned[:2] + [d[2]]
    by_x = plus(
        scaled(kvc * kbs / length**3, quarter),
        outer(-3 * kvc * kbs / length**5, turned, d),
        outer(2 * kvc / squared**2, w, d),
    )
    if MISTAKE == "2 for 3 in the vortex":
        by_x = plus(by_x, outer(kvc * kbs / length**5, turned, d))
    return force, by_x, identity(-kvc / squared, size)


class Scene:
    def __init__(self, path):
        root = ElementTree.parse(path).getroot()
        self.pairs, self.edges = [], [(int(edge.get("i")), int(edge.get("j"))) for edge in root.iter("edge")]
        three = any("pz" in element.attrib for element in root.iter("particle"))
        self.axes = "xyz" if three else "xy"
        self.mass, self.x, self.v, self.fixed = [], [], [], []
        self.drag, self.gravity = 0.0, [0.0] * len(self.axes)
        for element in root:
            self.element(element.tag, element.attrib)

    def element(self, tag, a):
        number = lambda name, otherwise=0.0: float(a.get(name, otherwise))
        if tag == "duration":
            self.duration = number("time")
        elif tag == "integrator":
            self.method, self.h = FULL.get(a["type"], a["type"]), number("dt")
        elif tag == "particle":
            self.mass.append(number("m"))
            self.x.append([number("p" + axis) for axis in self.axes])
            self.v.append([number("v" + axis) for axis in self.axes])
            self.fixed.append(number("fixed") != 0)
        elif tag == "springforce":
            i, j = self.edges[int(a["edge"])]
            self.pairs.append((i, j, spring, (number("k"), number("l0"), number("b"))))
        elif tag == "gravitationalforce":
            self.pairs.append((int(a["i"]), int(a["j"]), None, number("G")))
        elif tag == "vortexforce":
            self.pairs.append((int(a["i"]), int(a["j"]), vortex, (number("kbs"), number("kvc"))))
        elif tag == "dragdamping":
            self.drag += number("b")
        elif tag == "simplegravity":
            self.gravity = [g + number("f" + axis) for g, axis in zip(self.gravity, self.axes)]

    def forces(self, x, v):
        """Forces, and blocks of both Jacobians as {(row, column): (by_x, by_v)} lists."""
        size = len(self.axes)
        force = [[m * g - self.drag * c for g, c in zip(self.gravity, u)] for m, u in zip(self.mass, v)]
        blocks = []
        for p in range(len(x)):
            drag = identity(-self.drag, size)
            if MISTAKE == "drag's Jacobian divided by the mass":
                drag = identity(-self.drag / self.mass[p], size)
            blocks.append((p, p, identity(0.0, size), drag))
        for i, j, law, parameters in self.pairs:
            d = [a - b for a, b in zip(x[i], x[j])]
            w = [a - b for a, b in zip(v[i], v[j])]
            if law is None:
                f, by_x, by_v = gravitation(d, parameters * self.mass[i] * self.mass[j])
            else:
                f, by_x, by_v = law(d, w, *parameters)
            for axis in range(size):
                force[i][axis] += f[axis]
                force[j][axis] -= f[axis]
            for a, b, sign in ((i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)):
                if MISTAKE == "cross blocks only one way" and (a, b) == (j, i):
                    continue
                blocks.append((a, b, scaled(sign, by_x), scaled(sign, by_v)))
        return force, blocks

    def parts(self):
        """Particles that pairs connect."""
        root = list(range(len(self.x)))

        def find(p):
            while root[p] != p:
                p = root[p]
            return p

        for i, j, _, _ in self.pairs:
            root[find(i)] = find(j)
        groups = {}
        for p in range(len(self.x)):
            groups.setdefault(find(p), []).append(p)
        return groups.values()

    def step(self):
        h, size = self.h, len(self.axes)
        if self.method in ("explicit-euler", "symplectic-euler"):
            force, _ = self.forces(self.x, self.v)
            old = [u[:] for u in self.v]
            for p, f in enumerate(force):
                if not self.fixed[p]:
                    self.v[p] = [c + h * a / self.mass[p] for c, a in zip(self.v[p], f)]
                used = old[p] if self.method == "explicit-euler" else self.v[p]
                self.x[p] = [c + h * u for c, u in zip(self.x[p], used)]
            return
        if self.method != "linearized-implicit-euler":
            raise SystemExit("unknown integrator " + self.method)
        ahead = [[c + h * u for c, u in zip(x, v)] for x, v in zip(self.x, self.v)]
        force, blocks = self.forces(ahead, self.v)
        change = [[0.0] * size for _ in self.x]
        by_row = {}
        for block in blocks:
            by_row.setdefault(block[0], []).append(block)
        for part in self.parts():
            place = {p: k * size for k, p in enumerate(q for q in part if not self.fixed[q])}
            rows = [[0.0] * (len(place) * size + 1) for _ in range(len(place) * size)]
            for p, at in place.items():
                for axis in range(size):
                    rows[at + axis][at + axis] += self.mass[p]
                    rows[at + axis][-1] = h * force[p][axis]
                for _, column, by_x, by_v in by_row[p]:
                    if column in place:
                        for r in range(size):
                            for c in range(size):
                                a = h * h * by_x[r][c] + h * by_v[r][c]
                                rows[at + r][place[column] + c] -= a
            solution = eliminate(rows)
            for p, at in place.items():
                change[p] = solution[at : at + size]
        for p in range(len(self.x)):
            self.v[p] = [c + a for c, a in zip(self.v[p], change[p])]
            self.x[p] = [c + h * u for c, u in zip(self.x[p], self.v[p])]


def eliminate(rows):
    size = len(rows)
    for k in range(size):
        best = max(range(k, size), key=lambda r: abs(rows[r][k]))
        rows[k], rows[best] = rows[best], rows[k]
        for r in range(k + 1, size):
            factor = rows[r][k] / rows[k][k]
            if factor != 0.0:
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[k])]
    solution = [0.0] * size
    for k in reversed(range(size)):
        known = sum(rows[k][c] * solution[c] for c in range(k + 1, size))
        solution[k] = (rows[k][-1] - known) / rows[k][k]
    return solution


def main():
    if len(sys.argv) not in (4, 6) or sys.argv[2] != "-o":
        raise SystemExit("usage: student.py scene.xml -o trace.csv")
    scene = Scene(sys.argv[1])
    steps = math.ceil(scene.duration / scene.h)
    names = [part + axis for part in ("", "v") for axis in scene.axes]
    with open(sys.argv[3], "w") as trace:
        columns = [f"{name}{p}" for p in range(len(scene.x)) for name in names]
        trace.write(",".join(["step", "time"] + columns) + "\n")
        for step in range(steps + 1):
            if step > 0:
                scene.step()
            values = [c for x, v in zip(scene.x, scene.v) for c in x + v]
            trace.write(",".join([str(step), repr(step * scene.h)] + [repr(c) for c in values]) + "\n")


main()
