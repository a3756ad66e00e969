#!/usr/bin/env python3
"""Assembly of the tangent stiffness matrix of triangles by scikit-fem: St. Venant and Kirchhoff's material, one point of
integration, into a sparse matrix of scipy.

    F = I + grad u    S = mu (FtF - I) + lambda/2 tr(FtF - I) I    integral of (dF S + F dS) : grad v

The scene is the sheet of `simulate generate sheet`: side 1, stretched by 1.1 along x. Mesh and basis are built before the
clock starts. Prints the Frobenius norm of the matrix, divided by the modulus, as x0.

    pip install scikit-fem
    skfem_triangles.py SEGMENTS TIME_STEP STEPS MODULUS
"""
import time

import numpy as np
from skfem import Basis, BilinearForm, ElementTriP1, ElementVector, MeshTri
from skfem.helpers import ddot, eye, grad, mul, trace, transpose

from sheet import STRETCH, arguments, lame, mesh


def main():
    options = arguments(__doc__)
    mu, lam = lame(options.modulus)
    places, triangles = mesh(options.segments)
    basis = Basis(MeshTri(places.T, triangles.T), ElementVector(ElementTriP1()), intorder=1)

    def second(strain):
        return 2 * mu * strain + lam * eye(trace(strain), 2)

    @BilinearForm
    def tangent(u, v, w):
        f = grad(w["now"])
        f = f + eye(np.ones_like(f[0, 0]), 2)
        stress = second(0.5 * (mul(transpose(f), f) - eye(np.ones_like(f[0, 0]), 2)))
        df = grad(u)
        half = mul(transpose(f), df)
        return ddot(mul(df, stress) + mul(f, second(0.5 * (half + transpose(half)))), grad(v))

    now = np.zeros(basis.N)
    now[basis.nodal_dofs[0]] = (STRETCH - 1) * places[:, 0]
    assemble = lambda: tangent.assemble(basis, now=basis.interpolate(now))
    matrix = assemble()
    start = time.perf_counter()
    for _ in range(options.steps):
        assemble()
    seconds = (time.perf_counter() - start) / options.steps
    norm = np.sqrt((matrix.data ** 2).sum()) / options.modulus
    print(f"triangles={len(triangles)} ns_per_step={seconds * 1e9:.6g} x0={norm:.17g}")


main()
