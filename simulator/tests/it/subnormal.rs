//! Subnormal numbers: a stiff step that comes to rest passes through them. The linear solvers took their few digits
//! for an inaccurate solution, and the scene failed. Found by `grade stability`.

use crate::support::shared::parse;
use simulator::simulation::Simulation;

#[test]
fn a_stiff_oscillator_comes_to_rest() {
    for method in ["linearized-implicit-euler", "implicit-euler", "fast-mass-spring"] {
        for stiffness in ["1e4", "1e8", "1e12"] {
            let text = format!(
                r#"<scene><duration time="40"/><integrator type="{method}" dt="0.1"/>
                <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
                <particle m="1" px="1" py="0.5" vx="0" vy="0" fixed="0"/>
                <edge i="0" j="1"/><springforce edge="0" k="{stiffness}" l0="0"/></scene>"#
            );
            let mut simulation = Simulation::new(&parse(&text));
            let mut subnormal = false;
            while simulation
                .advance()
                .unwrap_or_else(|error| panic!("{method} {stiffness}: {error}"))
            {
                let state = simulation.state();
                subnormal |= state.positions.iter().any(|x| x.is_subnormal());
            }
            let left = simulation.state().positions[2].abs();
            // The local step of fast mass-spring squares a length: where that is below the smallest number, 2⁻¹⁰⁷⁴, a
            // spring pulls at nothing.
            let feels_all = method != "fast-mass-spring";
            let rest = if feels_all { f64::MIN_POSITIVE } else { 2.0_f64.powi(-537) };
            assert!((subnormal || !feels_all) && left < rest, "{method} {stiffness}: {left:e}");
        }
    }
}
