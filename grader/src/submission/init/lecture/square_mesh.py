"""A square of springs, for simulations of your own: the scenes that are graded bring their points and edges."""

from utils import not_implemented


def generate(side_length, n_seg):
    """The points of a grid of n_seg by n_seg squares, and the edges of all squares with both diagonals: [x, e]."""
    # your code here
    not_implemented("square_mesh.generate")
