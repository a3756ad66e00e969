#!/usr/bin/env python3
"""A fast mass-spring simulator: called as `simulate.py SCENE TRACE SOLVER`, it turns a scene into a trace.

The protocol
    SCENE   JSON beside an OBJ file: {"obj": "net.obj", "k": 300, "m": 1, "b": [1, 5], "wind": false}. k is the stiffness
            of every spring, m the mass of every vertex (without it, a vertex weighs its mixed Voronoi area), b the
            pinned vertices, counted from 1. Each pair of vertices of a face is a spring, once; its rest length is that of
            the OBJ file. The vertices start there, at rest.
    TRACE   CSV: a header `step,time,x0,y0,z0,x1,...`, then one row for each state: the initial one, then 30 steps of
            1/30 s. Write all digits: repr() does. Velocities are not needed.
    SOLVER  dense or sparse: which of the two implementations is graded.
    Exit with status 0 on success. Your standard error is shown in the report of a failed run. Read no
    other file, and write to the working directory only; there is no network.
"""

import itertools
import json
import sys

TIME_STEP = 1 / 30
STEPS = 30
EXTERNAL_FORCE = (0.0, -9.8, 0.0)  # on each vertex, not scaled by its mass


class Scene:
    def __init__(self, path):
        with open(path) as file:
            settings = json.load(file)
        self.stiffness = settings["k"]
        self.mass = settings.get("m")  # None: not given
        self.wind = settings.get("wind", False)
        pins = settings.get("b", [])
        self.pinned = [vertex - 1 for vertex in (pins if isinstance(pins, list) else [pins])]
        self.rest = []
        self.springs = []  # pairs of vertices from 0
        known = set()
        with open(settings["obj"]) as mesh:
            for line in mesh:
                kind, *words = line.split() or [""]
                if kind == "v":
                    self.rest.append([float(word) for word in words[:3]])
                elif kind == "f":
                    face = [int(word.split("/")[0]) - 1 for word in words]  # 3/1 is vertex 3
                    for i, j in itertools.combinations(face, 2):
                        if (min(i, j), max(i, j)) not in known:
                            known.add((min(i, j), max(i, j)))
                            self.springs.append((i, j))
        self.x = [list(vertex) for vertex in self.rest]
        self.previous = [list(vertex) for vertex in self.rest]


def precompute(scene, is_dense):
    """What does not change from step to step."""
    # To do: signed incidence matrix, masses, Q and its factorisation.


def step(scene):
    """One step."""
    # To do: 50 rounds of the local step (a vector d for each spring) and the global step (Q p = b).
    scene.previous = [list(vertex) for vertex in scene.x]


def main():
    scene = Scene(sys.argv[1])
    precompute(scene, sys.argv[3] == "dense")
    with open(sys.argv[2], "w") as trace:
        names = [f"x{i},y{i},z{i}" for i in range(len(scene.x))]
        print("step,time", *names, sep=",", file=trace)
        for number in range(STEPS + 1):
            if number > 0:
                step(scene)
            row = [number, number * TIME_STEP, *itertools.chain(*scene.x)]
            print(*map(repr, row), sep=",", file=trace)


main()
