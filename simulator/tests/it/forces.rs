//! Single forces, against their formulas and each other.

use scene::Scene;
use simulator::force::{Block, ElementJacobians, Force, ForceKind, JacobianSink, REGISTRY, State};
use simulator::system::{BuildForce, System};

use crate::support::shared::parse;

const WINDY: &str = r#"<scene>
    <duration time="1"/><integrator type="symplectic-euler" dt="0.1"/>
    <particle m="2" px="-1" py="5" pz="1" vx="0" vy="0" fixed="0"/>
    <particle m="3" px="1" py="6" pz="3" vx="0" vy="0" fixed="0"/>
    <particle m="3" px="0" py="6" pz="3" vx="0" vy="0" fixed="1"/>
    <windforce/>
    <windforce strength="0.5"/>
</scene>"#;

fn assert_close(values: &[f64], expected: &[f64]) {
    assert_eq!(values.len(), expected.len());
    for (value, expected) in values.iter().zip(expected) {
        assert!((value - expected).abs() < 1e-12, "{values:?} {expected:?}");
    }
}

/// The formula of the wind at phase `phi`, for a strength of 1.5 in all.
fn wind(phi: f64) -> [f64; 3] {
    let x = 4.5 + 1.5 * (5.0 * phi).cos();
    [x, (0.3 + phi).cos() + 1.0, phi.sin()].map(|component| 1.5 * component)
}

/// The force at a state, which is that of the wind alone.
fn force_at<const D: usize>(text: &str, positions: &[f64], time: f64) -> Vec<f64>
where
    ForceKind: BuildForce<D>,
{
    let mut force = vec![0.0; positions.len()];
    let velocities = vec![7.0; positions.len()];
    System::<D>::new(&parse(text)).force(positions, &velocities, time, &mut force).unwrap();
    force
}

#[test]
fn wind_depends_on_time_and_initial_position() {
    // The box at the start is 2 × 1 × 2, and its diagonal 3: where the particles are by now does not change it.
    let positions = [4.0, 9.0, 8.0, -0.5, 7.0, 1.0, 2.0, 2.0, 2.0];
    let force = force_at::<3>(WINDY, &positions, 0.75);
    let expected = [wind(0.75 + 4.0 / 3.0), wind(0.75 - 0.5 / 3.0), [0.0; 3]].concat();
    assert_close(&force, &expected);
}

#[test]
fn in_two_dimensions_the_box_and_the_force_are_flat() {
    let flat = WINDY.replace(r#"pz="1""#, "").replace(r#"pz="3""#, "");
    let force = force_at::<2>(&flat, &[-1.0, 5.0, 1.0, 6.0, 0.0, 6.0], 0.25);
    let fifth = 1.0 / 5.0_f64.sqrt();
    let expected = [wind(0.25 - fifth), wind(0.25 + fifth), [0.0; 3]];
    assert_close(&force, &expected.map(|[x, y, _]| [x, y]).concat());
}

#[test]
fn wind_on_one_particle_depends_on_time_alone() {
    let single = r#"<scene><duration time="1"/><integrator type="implicit" dt="0.1"/>
        <particle m="1" px="4" py="0" pz="0" vx="0" vy="0" fixed="0"/>
        <windforce strength="1.5"/></scene>"#;
    assert_close(&force_at::<3>(single, &[4.0, 0.0, 0.0], 0.5), &wind(0.5));
    let mut n_couplings = 0;
    System::<3>::new(&parse(single)).couplings(&mut |_| n_couplings += 1);
    assert_eq!(n_couplings, 0);
}

/// The force of the scene's elements, all of one kind.
fn force<const D: usize>(scene: &Scene) -> Box<dyn Force<D>>
where
    ForceKind: BuildForce<D>,
{
    let tag = scene.forces[0].schema.tag;
    let kind = REGISTRY.iter().find(|kind| kind.schema.tag == tag).unwrap();
    kind.build(scene, &scene.forces.iter().enumerate().collect::<Vec<_>>())
}

/// A chain with springs of these elements, long enough for vectors.
fn chain(spring: impl Fn(usize) -> String) -> Scene {
    let mut text =
        r#"<scene><duration time="1"/><integrator type="implicit" dt="0.1"/>"#.to_owned();
    for i in 0..40 {
        let y = 0.3 * (1.7 * f64::from(i)).sin();
        text += &format!(r#"<particle m="1" px="{i}" py="{y}" vx="0" vy="0" fixed="0"/>"#);
    }
    for i in 0..39 {
        text += &format!(r#"<edge i="{i}" j="{}"/>{}"#, i + 1, spring(i));
    }
    parse(&(text + "</scene>"))
}

struct Blocks(Vec<(usize, usize, Block<2>)>);

impl JacobianSink<2> for Blocks {
    fn add(&mut self, element: ElementJacobians<'_, 2>) {
        let push = |row, column, block: &Block<2>| self.0.push((row, column, *block));
        element.spread(element.by_position, push);
    }
}

/// Force, energy and Jacobian at a time.
fn values(scene: &Scene, time: f64) -> (Vec<f64>, Option<f64>, Blocks) {
    let force = force::<2>(scene);
    let (positions, velocities) = (scene.positions(), scene.velocities());
    let state = State { masses: &[1.0; 40], positions: &positions, velocities: &velocities, time };
    let (mut sum, mut blocks) = (vec![0.0; 80], Blocks(Vec::new()));
    force.add_force(state, 0..40, &mut sum).unwrap();
    force.add_jacobians(state, &mut blocks).unwrap();
    (sum, force.energy(state), blocks)
}

#[test]
fn scripted_spring_equals_spring_of_current_rest_length() {
    let scripted = chain(|i| {
        let k = 1 + i;
        format!(r#"<scriptedspringforce edge="{i}" k="{k}" l0="0.5" l1="2" t1="4"/>"#)
    });
    // Numbers whose products are exact.
    for (time, length) in [(0.0, 0.5), (1.0, 0.875), (2.0, 1.25), (4.0, 2.0), (9.0, 2.0)] {
        let constant = chain(|i| {
            let k = 1 + i;
            format!(r#"<springforce edge="{i}" k="{k}" l0="{length}"/>"#)
        });
        let (found, expected) = (values(&scripted, time), values(&constant, time));
        assert_eq!((found.0, found.1, found.2.0), (expected.0, expected.1, expected.2.0));
    }
}

/// The block of `∂F/∂x` for the first of two particles, `(2, −1, 2)` apart.
struct FirstBlock(Option<Block<3>>);

impl JacobianSink<3> for FirstBlock {
    fn add(&mut self, element: ElementJacobians<'_, 3>) {
        self.0 = Some(element.by_position[0]);
    }
}

/// The energies are positive semi-definite along `d`, so `∂F/∂x` is minus that. `d dᵀ` is in numbers.
#[test]
fn gauss_newton_is_the_square_of_the_derivative_of_the_strain() {
    let dd = Block::<3>::from([[4.0, -2.0, 4.0], [-2.0, 1.0, -2.0], [4.0, -2.0, 4.0]]);
    let assert_is = |element: &str, expected: Block<3>| {
        let scene = parse(&format!(
            r#"<scene><duration time="1"/><integrator type="explicit-euler" dt="1"/>
            <particle m="2" px="2.5" py="-1" pz="1" vx="1" vy="0" fixed="0"/>
            <particle m="3" px="0.5" py="0" pz="-1" vx="0" vy="1" fixed="0"/>
            <edge i="0" j="1"/>{element}</scene>"#
        ));
        let (positions, velocities) = (scene.positions(), scene.velocities());
        let state = State {
            masses: &[2.0, 3.0],
            positions: &positions,
            velocities: &velocities,
            time: 0.0,
        };
        let mut sink = FirstBlock(None);
        force::<3>(&scene).add_gauss_newton(state, &mut sink).unwrap();
        let found = sink.0.unwrap();
        let bound = 1e-14 * expected.amax();
        assert!((found - expected).amax() <= bound, "{element}: {found} for {expected}");
    };
    // −k n nᵀ with n = d/3, k = 4.5: stretched, compressed, at rest.
    for l0 in ["1", "5", "3"] {
        assert_is(&format!(r#"<springforce edge="0" k="4.5" l0="{l0}"/>"#), dd * -0.5);
    }
    // −4k/l0² d dᵀ: stretched, compressed, at rest.
    for (k, l0, factor) in [("0.75", "2", -0.75), ("6.25", "5", -1.0), ("2.25", "3", -1.0)] {
        assert_is(&format!(r#"<greenspringforce edge="0" k="{k}" l0="{l0}"/>"#), dd * factor);
    }
    // Its energy is negative, and no square.
    assert_is(r#"<gravitationalforce i="0" j="1" G="1.5"/>"#, Block::zeros());
}
