// Forces of a mass-spring system. Points, velocities and forces are pairs [x, y]; return the force, not its potential.

function missing(name) {
    console.error(`${name} is not implemented`);
    process.exit(77);
}

// The force of gravity g on a particle of mass m.
export function simpleGravity(m, g) {
    return missing("simpleGravity");
}

// The force on particle i of a spring to particle j with stiffness k, rest length l0 and damping b; j feels the opposite.
export function spring(xi, xj, vi, vj, k, l0, b) {
    return missing("spring");
}

// The force on particle i of the attraction by particle j with the constant G; j feels the opposite.
export function gravitation(xi, xj, mi, mj, G) {
    return missing("gravitation");
}

// The force of drag b on a particle with velocity v.
export function drag(v, b) {
    return missing("drag");
}
