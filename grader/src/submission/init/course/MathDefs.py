"""Vectors, matrices, and the end of a run that needs what is not there yet."""

import sys


def zeros(size):
    return [0.0] * size


def zero_matrix(size):
    return [[0.0] * size for _ in range(size)]


PIECE solve.py


PIECE not_implemented.py
