#!/usr/bin/env python3
"""Symplectic Euler on triangles in a Taichi kernel on the processor's cores, as Taichi's own examples of elastic bodies
write it: each triangle adds its forces to its corners, atomically.

    F = (x2 - x1 | x3 - x1) B    S = mu (FtF - I) + lambda/2 tr(FtF - I) I    force on a: -A F S w_a
    v += h/m f                   x += h v

The scene is the sheet of `simulate generate sheet`: side 1, density 1000, stretched by 1.1 along x, St. Venant and
Kirchhoff's material. In double precision, as ours. The kernels are compiled before the clock starts.

    pip install taichi
    taichi_triangles.py SEGMENTS TIME_STEP STEPS MODULUS
"""
import time

import numpy as np
import taichi as ti

from sheet import STRETCH, arguments, lame, mesh

ti.init(arch=ti.cpu, default_fp=ti.f64, log_level=ti.ERROR)

DENSITY = 1000.0


def main():
    options = arguments(__doc__)
    h = options.time_step
    mu, lam = lame(options.modulus)
    places, triangles = mesh(options.segments)
    corners = places[triangles]
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    areas = 0.5 * np.linalg.det(sides)
    masses = np.bincount(triangles.ravel(), np.repeat(DENSITY * areas / 3, 3))

    x = ti.Vector.field(2, float, len(places))
    v = ti.Vector.field(2, float, len(places))
    force = ti.Vector.field(2, float, len(places))
    mass = ti.field(float, len(places))
    area = ti.field(float, len(triangles))
    inverse = ti.Matrix.field(2, 2, float, len(triangles))
    corner = ti.Vector.field(3, int, len(triangles))
    mass.from_numpy(masses)
    area.from_numpy(areas)
    inverse.from_numpy(np.linalg.inv(sides))
    corner.from_numpy(triangles.astype(np.int32))

    def reset():
        x.from_numpy(places * [STRETCH, 1.0])
        v.fill(0)
        force.fill(0)

    @ti.kernel
    def step():
        for e in corner:
            i, j, k = corner[e][0], corner[e][1], corner[e][2]
            f = ti.Matrix.cols([x[j] - x[i], x[k] - x[i]]) @ inverse[e]
            twice = f.transpose() @ f - ti.Matrix.identity(float, 2)
            stress = mu * twice + 0.5 * lam * twice.trace() * ti.Matrix.identity(float, 2)
            pull = area[e] * f @ stress @ inverse[e].transpose()
            first = ti.Vector([pull[0, 0], pull[1, 0]])
            second = ti.Vector([pull[0, 1], pull[1, 1]])
            force[i] += first + second
            force[j] -= first
            force[k] -= second
        for i in x:
            v[i] += h / mass[i] * force[i]
            x[i] += h * v[i]
            force[i] = [0.0, 0.0]

    reset()
    step()
    reset()
    ti.sync()
    start = time.perf_counter()
    for _ in range(options.steps):
        step()
    ti.sync()
    seconds = (time.perf_counter() - start) / options.steps
    print(f"triangles={len(triangles)} ns_per_step={seconds * 1e9:.6g} x0={x[0][0]:.17g}")


main()
