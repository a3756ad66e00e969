"""The state of a scene, and the sums of its forces.

A vector has two entries for each particle: x0 y0 x1 y1 ... So has m, of which both are the particle's mass. A force adds

    addGradEToTotal(x, v, m, gradE)    the gradient of its energy, which is minus the force
    addHessXToTotal(x, v, m, hessE)    the derivatives of that gradient by x: minus a Jacobian of the force
    addHessVToTotal(x, v, m, hessE)    and by v
"""


class TwoDScene:
    def __init__(self):
        self.x, self.v, self.m = [], [], []
        # A fixed particle feels no force: it keeps its velocity, and moves by it.
        self.fixed = []
        self.forces = []

    def accumulateGradU(self, F, dx=None, dv=None):
        """Adds the gradient of all energies at the positions x + dx and the velocities v + dv; None: at x and v."""
        for force in self.forces:
            force.addGradEToTotal(plus(self.x, dx), plus(self.v, dv), self.m, F)

    def accumulateddUdxdx(self, A, dx=None, dv=None):
        """Adds its derivatives by positions."""
        for force in self.forces:
            force.addHessXToTotal(plus(self.x, dx), plus(self.v, dv), self.m, A)

    def accumulateddUdxdv(self, A, dx=None, dv=None):
        """Adds its derivatives by velocities."""
        for force in self.forces:
            force.addHessVToTotal(plus(self.x, dx), plus(self.v, dv), self.m, A)


def plus(a, b):
    return a if b is None else [first + second for first, second in zip(a, b)]
