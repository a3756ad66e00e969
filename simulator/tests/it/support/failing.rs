//! Scenes with steps that fail, or succeed doubtfully.

/// Four particles, flung at 30 m/s with every pair of five tied by a spring of another stiffness: plain Newton runs
/// in circles in the first step of 1 s. `b` is the springs' damping.
pub(crate) fn flung(b: &str) -> String {
    let particles = [
        [0.0, 0.0, 0.0, 0.0],
        [0.713, 0.179, -16.76, 28.54],
        [1.191, 0.066, -16.61, 8.91],
        [-0.42, 0.303, -10.73, 7.86],
        [-1.765, -0.806, 28.07, 22.53],
    ];
    let springs = [
        (1, 0, 340356),
        (2, 0, 196142647),
        (2, 1, 356302),
        (3, 0, 497098166),
        (3, 1, 52385440),
        (3, 2, 1204651),
        (4, 0, 182722),
        (4, 1, 11026),
        (4, 2, 247508143),
        (4, 3, 15473),
    ];
    let mut text =
        r#"<scene><duration time="3"/><integrator type="implicit-euler" dt="1"/>"#.to_owned();
    for (idx, [x, y, vx, vy]) in particles.into_iter().enumerate() {
        let fixed = u8::from(idx == 0);
        text +=
            &format!(r#"<particle m="1" px="{x}" py="{y}" vx="{vx}" vy="{vy}" fixed="{fixed}"/>"#);
    }
    for (edge, (i, j, k)) in springs.into_iter().enumerate() {
        text += &format!(
            r#"<edge i="{i}" j="{j}"/><springforce edge="{edge}" k="{k}" l0="1" b="{b}"/>"#
        );
    }
    text + "</scene>"
}

/// A particle that the first step's guess `q + h v` puts onto the end of its spring.
pub(crate) const ONTO: &str = r#"<scene><duration time="1"/><integrator type="linearized-implicit-euler" dt="0.5"/>
    <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
    <particle m="1" px="0.5" py="0" vx="-1" vy="0" fixed="0"/>
    <edge i="0" j="1"/><springforce edge="0" k="1" l0="1"/></scene>"#;

/// A compressed spring, whose `h² k (l0 − l)/l` is the mass of its free end but for rounding: across the spring, the matrix
/// is zero but for rounding. `g` pulls across it.
pub(crate) fn compressed(integrator: &str, g: f64) -> String {
    format!(
        r#"<scene><duration time="0.2"/><integrator type="{integrator}" dt="0.1"/>
        <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <particle m="1" px="1" py="0" vx="0" vy="0" fixed="0"/>
        <edge i="0" j="1"/><springforce edge="0" k="100" l0="2"/>
        <simplegravity fx="0" fy="{g}"/></scene>"#
    )
}
