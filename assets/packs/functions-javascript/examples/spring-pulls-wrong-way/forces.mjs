// Forces of a mass-spring system. Points, velocities and forces are pairs [x, y]; return the force, not its potential.

// The force of gravity g on a particle of mass m.
export function simpleGravity(m, g) {
    return [m * g[0], m * g[1]];
}

// The force on particle i of a spring to particle j with stiffness k, rest length l0 and damping b; j feels the opposite.
export function spring(xi, xj, vi, vj, k, l0, b) {
    const d = [xi[0] - xj[0], xi[1] - xj[1]];
    const length = Math.hypot(...d);
    const n = [d[0] / length, d[1] / length];
    const speed = n[0] * (vi[0] - vj[0]) + n[1] * (vi[1] - vj[1]);
    const size = k * (length - l0) - b * speed;
    return [size * n[0], size * n[1]];
}

// The force on particle i of the attraction by particle j with the constant G; j feels the opposite.
export function gravitation(xi, xj, mi, mj, G) {
    const d = [xi[0] - xj[0], xi[1] - xj[1]];
    const size = (-G * mi * mj) / Math.hypot(...d) ** 3;
    return [size * d[0], size * d[1]];
}

// The force of drag b on a particle with velocity v.
export function drag(v, b) {
    return [-b * v[0], -b * v[1]];
}
