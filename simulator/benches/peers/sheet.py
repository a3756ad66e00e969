"""The sheet of `simulate generate sheet`, side 1, for the peers that step or assemble it: arguments, material, triangles."""
import argparse

import numpy as np

NU, STRETCH = 0.3, 1.1


def arguments(description):
    """Those of a peer, with its description."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("segments", type=int)
    parser.add_argument("time_step", type=float)
    parser.add_argument("steps", type=int)
    parser.add_argument("modulus", type=float)
    return parser.parse_args()


def lame(modulus):
    """Lame's parameters of plane stress."""
    return modulus / (2 * (1 + NU)), modulus * NU / (1 - NU * NU)


def mesh(n):
    """Places of the particles, and corners of the triangles."""
    row, column = [axis.ravel() for axis in np.divmod(np.arange((n + 1) ** 2), n + 1)]
    places = np.stack([column / n, row / n], axis=1)
    row, column = np.divmod(np.arange(n * n), n)
    a = row * (n + 1) + column
    b, c, d = a + 1, a + n + 1, a + n + 2
    even = ((row + column) % 2 == 0)[:, None]
    first = np.where(even, np.stack([a, b, d], axis=1), np.stack([a, b, c], axis=1))
    second = np.where(even, np.stack([a, d, c], axis=1), np.stack([b, d, c], axis=1))
    return places, np.stack([first, second], axis=1).reshape(-1, 3)
