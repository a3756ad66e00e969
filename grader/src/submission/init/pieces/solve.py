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
