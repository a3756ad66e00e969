#!/usr/bin/env python3
"""A mass-spring simulator: called as `simulate.py SCENE TRACE`, it turns a scene into a trace.

PIECE protocol_xml.txt
"""

import math
import sys
import xml.etree.ElementTree as ElementTree


PIECE not_implemented.py


PIECE read_root.py


class Scene:
    def __init__(self, path):
        root = read_root(path)
        self.duration = float(root.find("duration").get("time"))
        integrator = root.find("integrator")
        self.method = integrator.get("type")
        self.dt = float(integrator.get("dt"))
        particles = root.findall("particle")
        self.mass = [float(p.get("m")) for p in particles]
        self.fixed = [p.get("fixed") == "1" for p in particles]
        self.x = [[float(p.get("px")), float(p.get("py"))] for p in particles]
        self.v = [[float(p.get("vx")), float(p.get("vy"))] for p in particles]
        # To do: read ELEMENTS.


def forces(scene):
    """The force on each particle at the current state."""
    total = [[0.0, 0.0] for _ in scene.x]
    # To do: add FORCES.
    return total


def step(scene):
    """Explicit Euler: positions with the old velocities, velocities with the forces of the old state."""
    # To do: METHODS.
    force = forces(scene)
    for i in range(len(scene.x)):
        for axis in range(2):
            # A fixed particle keeps its velocity, and moves by it.
            scene.x[i][axis] += scene.dt * scene.v[i][axis]
            if not scene.fixed[i]:
                scene.v[i][axis] += scene.dt * force[i][axis] / scene.mass[i]


def simulate(scene_file, trace_file):
    scene = Scene(scene_file)
    steps = math.ceil(scene.duration / scene.dt)
    with open(trace_file, "w") as trace:
        names = [f"x{i},y{i},vx{i},vy{i}" for i in range(len(scene.x))]
        print("step,time", *names, sep=",", file=trace)
        for number in range(steps + 1):
            if number > 0:
                step(scene)
            row = [number, number * scene.dt]
            for x, v in zip(scene.x, scene.v):
                row += x + v
            print(*map(repr, row), sep=",", file=trace)


PIECE main.py
