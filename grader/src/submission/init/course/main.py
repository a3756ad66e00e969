#!/usr/bin/env python3
"""Reads a scene, takes its steps and writes its trace: called as `main.py SCENE TRACE`. Nothing is to be done here.

PIECE protocol_xml.txt
"""

import math
import sys
import xml.etree.ElementTree as ElementTree

from MathDefs import not_implemented
from TwoDScene import TwoDScene
INCLUDES

STEPPERS = {
STEPPER_LIST
}


PIECE read_root.py


def path_length(scene, particles):
    """The length of the path through these particles at the start."""
    places = [scene.x[2 * i:2 * i + 2] for i in particles]
    return sum(math.dist(a, b) for a, b in zip(places, places[1:]))


def simulate(scene_file, trace_file):
    root = read_root(scene_file)
    scene = TwoDScene()
    for particle in root.findall("particle"):
        number = lambda name: float(particle.get(name))
        scene.m += [number("m"), number("m")]
        scene.x += [number("px"), number("py")]
        scene.v += [number("vx"), number("vy")]
        scene.fixed.append(number("fixed") != 0)
    edges = [(int(edge.get("i")), int(edge.get("j"))) for edge in root.findall("edge")]
    for element in root:
        number = lambda name, otherwise="": float(element.get(name, otherwise))
FORCES
    integrator = root.find("integrator")
    kind, dt = integrator.get("type"), float(integrator.get("dt"))
    if kind not in STEPPERS:
        not_implemented(kind)
    stepper = STEPPERS[kind]()

    steps = math.ceil(float(root.find("duration").get("time")) / dt)
    with open(trace_file, "w") as trace:
        names = [f"x{i},y{i},vx{i},vy{i}" for i in range(len(scene.fixed))]
        print("step,time", *names, sep=",", file=trace)
        for step in range(steps + 1):
            if step > 0:
                stepper.stepScene(scene, dt)
            row = [step, step * dt]
            for i in range(len(scene.fixed)):
                row += scene.x[2 * i:2 * i + 2] + scene.v[2 * i:2 * i + 2]
            print(*map(repr, row), sep=",", file=trace)


PIECE main.py
