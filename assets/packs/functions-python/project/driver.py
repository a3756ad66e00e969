"""driver.py SCENE TRACE: takes the steps of a scene with the functions of forces.py.
driver.py --calls CALLS ANSWERS: calls the functions, one in each line."""

import math
import sys
import xml.etree.ElementTree as ElementTree

import forces


def answer(line):
    """The force on each particle. A line holds the function, the dimension, masses, positions and velocities of the particles, and
    parameters."""
    name, _, *words = line.split()
    a = [float(word) for word in words]
    if name == "gravity": return forces.simple_gravity(a[0], a[5:])
    if name == "drag": return forces.drag(a[3:5], a[5])
    points = [a[k : k + 2] for k in (2, 4, 6, 8)]
    x, y = forces.spring(*points, *a[10:]) if name == "spring" else forces.gravitation(*points[:2], *a[:2], *a[10:])
    return x, y, -x, -y


if sys.argv[1] == "--calls":
    try: answers = [answer(line) for line in open(sys.argv[2])]
    except NotImplementedError as missing: sys.exit(print(missing, file=sys.stderr) or 77)
    with open(sys.argv[3], "w") as file:
        for values in answers: print(*map(repr, values), file=file)
    sys.exit()

scene = ElementTree.parse(sys.argv[1]).getroot()
def read(element, *names): return [float(element.get(name, "0")) for name in names]
particles = scene.findall("particle")
m = [read(p, "m")[0] for p in particles]
x = [read(p, "px", "py") for p in particles]
v = [read(p, "vx", "vy") for p in particles]
free = [p.get("fixed") != "1" for p in particles]
edges = [(int(e.get("i")), int(e.get("j"))) for e in scene.findall("edge")]


def total():
    """The force on each particle."""
    f = [[0.0, 0.0] for _ in m]
    def add(i, force, sign=1.0): f[i] = [f[i][0] + sign * force[0], f[i][1] + sign * force[1]]
    def add_pair(i, j, force): add(i, force), add(j, force, -1.0)
    for e in scene:
        if e.tag == "simplegravity":
            for i in range(len(m)): add(i, forces.simple_gravity(m[i], read(e, "fx", "fy")))
        elif e.tag == "dragdamping":
            for i in range(len(m)): add(i, forces.drag(v[i], *read(e, "b")))
        elif e.tag == "springforce":
            i, j = edges[int(e.get("edge"))]
            add_pair(i, j, forces.spring(x[i], x[j], v[i], v[j], *read(e, "k", "l0", "b")))
        elif e.tag == "gravitationalforce":
            i, j = int(e.get("i")), int(e.get("j"))
            add_pair(i, j, forces.gravitation(x[i], x[j], m[i], m[j], *read(e, "G")))
    return f


integrator = scene.find("integrator")
dt, is_explicit = read(integrator, "dt")[0], integrator.get("type") == "explicit-euler"
steps = math.ceil(read(scene.find("duration"), "time")[0] / dt)
with open(sys.argv[2], "w") as trace:
    print("step,time", *(f"x{i},y{i},vx{i},vy{i}" for i in range(len(m))), sep=",", file=trace)
    for step in range(steps + 1):
        if step > 0:
            try: f = total()
            except NotImplementedError as missing: sys.exit(print(missing, file=sys.stderr) or 77)
            for i in range(len(m)):
                old = v[i]
                if free[i]: v[i] = [v[i][a] + dt * f[i][a] / m[i] for a in range(2)]
                x[i] = [x[i][a] + dt * (old if is_explicit else v[i])[a] for a in range(2)]
        print(step, repr(step * dt), *(repr(c) for i in range(len(m)) for c in x[i] + v[i]), sep=",", file=trace)
