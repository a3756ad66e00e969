"""Projection, linear systems, and the end of a run that needs what is not there yet."""

import sys


def make_PD(hess):
    """The nearest positive semi-definite matrix of a symmetric one (a list of rows): negative eigenvalues become 0."""
    # your code here
    not_implemented("make_PD")


def solve(A, b):
    """The solution of A u = b, by elimination with row pivoting."""
    rows = [row + [value] for row, value in zip(A, b)]
    size = len(rows)
    for k in range(size):
        pivot = max(range(k, size), key=lambda row: abs(rows[row][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for row in rows[k + 1:]:
            factor = row[k] / rows[k][k]
            if factor != 0:
                for column in range(k, size + 1):
                    row[column] -= factor * rows[k][column]
    u = [0.0] * size
    for k in reversed(range(size)):
        rest = sum(rows[k][column] * u[column] for column in range(k + 1, size))
        u[k] = (rows[k][size] - rest) / rows[k][k]
    return u


def not_implemented(what):
    """Ends the program: exit code 77 says that the scene needs something that is not implemented, which is no crash."""
    print(f"{what} is not implemented", file=sys.stderr)
    sys.exit(77)
