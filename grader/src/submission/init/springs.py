#!/usr/bin/env python3
"""A fast mass-spring simulator: called as `simulate.py SCENE TRACE SOLVER`, it turns a scene into a trace.

PIECE protocol_json.txt
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
    """Data that stay the same in all steps."""
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
