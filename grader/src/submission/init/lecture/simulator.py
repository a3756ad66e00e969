#!/usr/bin/env python3
"""Reads a scene, takes its steps and writes its trace: called as `simulator.py SCENE TRACE`. Nothing is to be done here.
A <greenspringforce edge k l0/> is a spring of squared length on the <edge i j/> of that number.

PIECE protocol_xml.txt
"""

import math
import sys
import xml.etree.ElementTree as ElementTree

import time_integrator
from utils import not_implemented


PIECE read_root.py


def simulate(scene_file, trace_file):
    root = read_root(scene_file)
    integrator = root.find("integrator")
    if integrator.get("type") != "projected-newton":
        not_implemented(integrator.get("type"))
    h, tol = float(integrator.get("dt")), float(integrator.get("tolerance", TOLERANCE))
    particles = root.findall("particle")
    m = [float(particle.get("m")) for particle in particles]
    x = [[float(particle.get("px")), float(particle.get("py"))] for particle in particles]
    v = [[float(particle.get("vx")), float(particle.get("vy"))] for particle in particles]
    fixed = [float(particle.get("fixed")) != 0 for particle in particles]
    edges = [(int(edge.get("i")), int(edge.get("j"))) for edge in root.findall("edge")]
    e, l2, k = [], [], []
    for element in root:
        if element.tag == "greenspringforce":
            e.append(edges[int(element.get("edge"))])
            l2.append(float(element.get("l0")) ** 2)
            k.append(float(element.get("k")))
        if element.tag in (OTHERS):
            not_implemented(element.tag)

    steps = math.ceil(float(root.find("duration").get("time")) / h)
    with open(trace_file, "w") as trace:
        names = [f"x{i},y{i},vx{i},vy{i}" for i in range(len(x))]
        print("step,time", *names, sep=",", file=trace)
        for step in range(steps + 1):
            if step > 0:
                x, v = time_integrator.step_forward(x, e, v, m, l2, k, h, tol, fixed)
            row = [step, step * h]
            for position, velocity in zip(x, v):
                row += [*position, *velocity]
            print(*map(repr, row), sep=",", file=trace)


PIECE main.py
