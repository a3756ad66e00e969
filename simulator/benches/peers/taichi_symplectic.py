#!/usr/bin/env python3
"""Symplectic Euler in a Taichi kernel on the processor's cores, as Taichi's own examples of nets write it.

    v += h/m sum over neighbours of k (|d| - l)/|d| d        d = x_j - x_i, l the length at rest
    x += h v

The scene is the elastic square: side 1, density 1000, stretched by 1.4 along x. Each particle gathers the forces of its
eight neighbours, so that no two threads write to one number. In double precision, as ours. The kernels are compiled
before the clock starts.

    pip install taichi
    taichi_symplectic.py SEGMENTS TIME_STEP STEPS STIFFNESS
"""
import argparse
import time

import taichi as ti

ti.init(arch=ti.cpu, default_fp=ti.f64, log_level=ti.ERROR)

OFFSETS = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("segments", type=int)
    parser.add_argument("time_step", type=float)
    parser.add_argument("steps", type=int)
    parser.add_argument("stiffness", type=float)
    options = parser.parse_args()
    n, h, k = options.segments, options.time_step, options.stiffness
    side = n + 1
    mass = 1000 / (side * side)
    x = ti.Vector.field(2, float, (side, side))
    v = ti.Vector.field(2, float, (side, side))

    @ti.kernel
    def reset():
        for i, j in x:
            x[i, j] = [1.4 * (i / n - 0.5), j / n - 0.5]
            v[i, j] = [0.0, 0.0]

    @ti.kernel
    def step():
        for i, j in x:
            force = ti.Vector([0.0, 0.0])
            for di, dj in ti.static(OFFSETS):
                a, b = i + di, j + dj
                if 0 <= a < side and 0 <= b < side:
                    d = x[a, b] - x[i, j]
                    length = d.norm()
                    force += k * (length - ti.sqrt(float(di * di + dj * dj)) / n) / length * d
            v[i, j] += h / mass * force
        for i, j in x:
            x[i, j] += h * v[i, j]

    reset()
    step()
    reset()
    ti.sync()
    start = time.perf_counter()
    for _ in range(options.steps):
        step()
    ti.sync()
    seconds = (time.perf_counter() - start) / options.steps
    springs = 4 * n * n + 2 * n
    print(f"springs={springs} ms_per_step={seconds * 1e3:.4f} ns_per_spring_step={seconds / springs * 1e9:.3f} "
          f"x0={x[0, 0][0]:.17g}")


main()
