"""The programs printed in the lecture on elastodynamics, in other words and without numpy: `elastodynamics.py SCENE TRACE`.

As there, the loop of Newton's method may end before its first iteration, its last direction is not applied, the norm of
the directions is that of `LA.norm(p, inf)` of one row a particle, and the line search compares energies and nothing else.
Added: the reading of scenes, the writing of traces, and Hooke's spring, which the lecture names.
"""
import math
import sys
import xml.etree.ElementTree as ElementTree

NOT_IMPLEMENTED = 77


# Springs: each a pair of particles, its stiffness, its length at rest, and whether it is quadratic in the squared length.

def spring_energy(d, k, l, squared):
    d2 = d[0] * d[0] + d[1] * d[1]
    if squared:
        return l * l * 0.5 * k * (d2 / (l * l) - 1) ** 2
    return 0.5 * k * (math.sqrt(d2) - l) ** 2


def spring_gradient(d, k, l, squared):
    d2 = d[0] * d[0] + d[1] * d[1]
    factor = 2 * k * (d2 / (l * l) - 1) if squared else k * (1 - l / math.sqrt(d2))
    return [factor * d[0], factor * d[1]]


def spring_hessian(d, k, l, squared):
    d2 = d[0] * d[0] + d[1] * d[1]
    if squared:
        outer, identity = 4 * k / (l * l), 2 * k / (l * l) * (d2 - l * l)
    else:
        outer, identity = k * l / d2 ** 1.5, k * (1 - l / math.sqrt(d2))
    return [[outer * d[r] * d[c] + (identity if r == c else 0.0) for c in range(2)] for r in range(2)]


# The incremental potential, its gradient and its Hessian.

def difference(x, i, j):
    return [x[i][0] - x[j][0], x[i][1] - x[j][1]]


def potential(x, x_tilde, m, springs, h):
    inertia = 0.0
    for i in range(len(x)):
        d = [x[i][0] - x_tilde[i][0], x[i][1] - x_tilde[i][1]]
        inertia += 0.5 * m[i] * (d[0] * d[0] + d[1] * d[1])
    elastic = 0.0
    for i, j, k, l, squared in springs:
        elastic += spring_energy(difference(x, i, j), k, l, squared)
    return inertia + h * h * elastic


def potential_gradient(x, x_tilde, m, springs, h):
    elastic = [[0.0, 0.0] for _ in x]
    for i, j, k, l, squared in springs:
        g = spring_gradient(difference(x, i, j), k, l, squared)
        for axis in range(2):
            elastic[i][axis] += g[axis]
            elastic[j][axis] -= g[axis]
    return [m[i] * (x[i][axis] - x_tilde[i][axis]) + h * h * elastic[i][axis] for i in range(len(x)) for axis in range(2)]


def make_pd(block):
    """Negative eigenvalues become 0: those of [[B, -B], [-B, B]], which are 0 and twice those of B, and so of B itself."""
    (a, b), (_, d) = block
    mean, radius = (a + d) / 2, math.hypot((a - d) / 2, b)
    if mean - radius >= 0:
        return block
    if mean + radius <= 0:
        return [[0.0, 0.0], [0.0, 0.0]]
    angle = math.atan2(b, (a - d) / 2) / 2
    u = math.cos(angle), math.sin(angle)
    return [[(mean + radius) * u[r] * u[c] for c in range(2)] for r in range(2)]


def potential_hessian(x, m, springs, h):
    size = 2 * len(x)
    hessian = [[0.0] * size for _ in range(size)]
    for dof in range(size):
        hessian[dof][dof] = m[dof // 2]
    for i, j, k, l, squared in springs:
        block = make_pd(spring_hessian(difference(x, i, j), k, l, squared))
        for row, column, sign in [(i, i, 1), (i, j, -1), (j, i, -1), (j, j, 1)]:
            for r in range(2):
                for c in range(2):
                    hessian[2 * row + r][2 * column + c] += sign * h * h * block[r][c]
    return hessian


def solve(a, b):
    """Gaussian elimination of a positive definite matrix, whose zeros it passes over."""
    size = len(b)
    for p in range(size):
        others = [c for c in range(p + 1, size) if a[p][c] != 0.0]
        for r in range(p + 1, size):
            if a[r][p] != 0.0:
                factor = a[r][p] / a[p][p]
                for c in others:
                    a[r][c] -= factor * a[p][c]
                b[r] -= factor * b[p]
    for p in reversed(range(size)):
        b[p] = (b[p] - sum(a[p][c] * b[c] for c in range(p + 1, size))) / a[p][p]
    return b


# One time step.

def search_direction(x, x_tilde, m, springs, h):
    gradient = potential_gradient(x, x_tilde, m, springs, h)
    p = solve(potential_hessian(x, m, springs, h), [-g for g in gradient])
    return [p[2 * i:2 * i + 2] for i in range(len(x))]


def norm(p):
    return max(abs(row[0]) + abs(row[1]) for row in p)


def along(x, alpha, p):
    return [[x[i][axis] + alpha * p[i][axis] for axis in range(2)] for i in range(len(x))]


def step_forward(x, v, m, springs, h, tol):
    x_n, x_tilde = x, along(x, h, v)
    e_last = potential(x, x_tilde, m, springs, h)
    p = search_direction(x, x_tilde, m, springs, h)
    while norm(p) / h > tol:
        alpha = 1.0
        while potential(along(x, alpha, p), x_tilde, m, springs, h) > e_last:
            alpha /= 2
        x = along(x, alpha, p)
        e_last = potential(x, x_tilde, m, springs, h)
        p = search_direction(x, x_tilde, m, springs, h)
    v = [[(x[i][axis] - x_n[i][axis]) / h for axis in range(2)] for i in range(len(x))]
    return x, v


def main():
    scene = ElementTree.parse(sys.argv[1]).getroot()
    integrator = scene.find("integrator")
    particles, edges = scene.findall("particle"), scene.findall("edge")
    known = {"description", "duration", "integrator", "particle", "edge", "springforce", "greenspringforce"}
    others = {element.tag for element in scene} - known
    fixed = any(particle.get("fixed") == "1" for particle in particles)
    if integrator.get("type") != "projected-newton" or others or fixed or "pz" in particles[0].attrib:
        print("not implemented", file=sys.stderr)
        sys.exit(NOT_IMPLEMENTED)
    springs = []
    for squared, tag in [(False, "springforce"), (True, "greenspringforce")]:
        for spring in scene.findall(tag):
            edge = edges[int(spring.get("edge"))]
            pair = int(edge.get("i")), int(edge.get("j"))
            springs.append((*pair, float(spring.get("k")), float(spring.get("l0")), squared))
    m = [float(particle.get("m")) for particle in particles]
    x = [[float(particle.get(name)) for name in ("px", "py")] for particle in particles]
    v = [[float(particle.get(name)) for name in ("vx", "vy")] for particle in particles]
    h, tol = float(integrator.get("dt")), float(integrator.get("tolerance", "1e-2"))
    steps = math.ceil(float(scene.find("duration").get("time")) / h)
    with open(sys.argv[2], "w") as trace:
        print("step,time", *[f"x{i},y{i},vx{i},vy{i}" for i in range(len(x))], sep=",", file=trace)
        for step in range(steps + 1):
            print(step, step * h, *[value for row in zip(x, v) for pair in row for value in pair], sep=",", file=trace)
            if step < steps:
                x, v = step_forward(x, v, m, springs, h, tol)


if __name__ == "__main__":
    main()
