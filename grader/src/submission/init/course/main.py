#!/usr/bin/env python3
"""Reads a scene, takes its steps and writes its trace: called as `main.py SCENE TRACE`. Nothing is to be done here.

The protocol
    SCENE   XML. <duration time="..."/> and <integrator type="..." dt="..."/> set duration, method and step; each
            <particle m px py vx vy fixed/> is a particle, numbered from 0. Forces are further elements;
            springs refer to <edge i j/> by its number. Elements come in any order; ignore unknown ones.
    TRACE   CSV: a header `step,time,x0,y0,vx0,vy0,x1,...`, then one row for each state. The first row is the initial
            state, and ceil(duration / dt) rows follow. Write all digits: repr() does.
    Exit with status 0 on success, and with 77 for a scene that you do not support. Your standard error
    is shown in the report of a failed run. Read no other file, and write to the working directory only;
    there is no network.
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


def main():
    if not sys.argv[1].endswith(".xml"):
        not_implemented("this format of scenes")
    root = ElementTree.parse(sys.argv[1]).getroot()
    if any(axis in element.keys() for element in root.iter() for axis in ("pz", "vz", "fz")):
        not_implemented("a scene in three dimensions")
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
    with open(sys.argv[2], "w") as trace:
        names = [f"x{i},y{i},vx{i},vy{i}" for i in range(len(scene.fixed))]
        print("step,time", *names, sep=",", file=trace)
        for step in range(steps + 1):
            if step > 0:
                stepper.stepScene(scene, dt)
            row = [step, step * dt]
            for i in range(len(scene.fixed)):
                row += scene.x[2 * i:2 * i + 2] + scene.v[2 * i:2 * i + 2]
            print(*map(repr, row), sep=",", file=trace)


main()
