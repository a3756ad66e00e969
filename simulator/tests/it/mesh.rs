//! Convergence in the mesh: errors of rods, sheets, cubes and plates against closed forms, their orders, and the table and the picture of
//! `docs/methods.md`. `UPDATE_DOCS=1 cargo test --release -p simulator --test it mesh` rewrites both.
//!
//! ```text
//! rod           hinges c = α/(2h) on bars of length h       bending stiffness E I = α/2
//! triangles     ε = ∇Φᵀ∇Φ − I of elasticbodycstforce is twice Green's strain: a small stretch meets the modulus 4 E
//! shells        hinges k on equilateral triangles: a hinge k̃/2 θ², k̃ = 4 √3 k, makes a plate of D = √3/2 k̃ = 6 k
//! ```
//!
//! The plane problems, on `0 ≤ x ≤ L`, `−D/2 ≤ y ≤ D/2`, with the exact displacement at `x = 0` and `I = D³/12`:
//!
//! ```text
//! weight γ along x      u_x = γ/E (L x − x²/2 − ν y²/2)                                    u_y = −ν γ/E (L − x) y
//! shear (D²/4 − y²) P/(2I) at x = L
//!                       u_x = −P y/(6 E I) ((6L − 3x) x + (2 + ν) (y² − D²/4))
//!                       u_y = P/(6 E I) (3ν y² (L − x) + (4 + 5ν) D² x/4 + (3L − x) x²)
//! ```
//!
//! A cube whose faces are displaced by the gradient of a harmonic function: it has neither divergence nor Laplacian, so no load
//! and no Poisson's ratio is in its equation. A mesh that is its own reflection through each particle meets polynomials up to the
//! third degree at its particles, whatever its cells: the displacement must not be one.
//!
//! ```text
//! φ = cos(p x) cos(q y) cosh(r z),  r² = p² + q²        u = a ∇φ
//! ```
//!
//! A simply supported plate, an equilateral
//! triangle of height `a` about the origin, a side at `x = −a/3`, of any Poisson's ratio:
//!
//! ```text
//! load q        u_z = q/(64 a D) (x³ − 3x y² − a (x² + y²) + 4/27 a³) (4/9 a² − x² − y²)
//! ```
//!
//! Sources: Timoshenko and Goodier, Theory of Elasticity (1951), articles 20 and 86; in plane stress. Seung
//! and Nelson, Defects in flexible membranes with crystalline order (1988), for the stiffness of a plate of hinges; Timoshenko
//! and Woinowsky-Krieger, Theory of Plates and Shells (1959), article 71. The loads are so small that all materials are linear.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use scene::{Dimension, ForceElement, Particle, Scene};
use simulator::generate::{Block, Generator, Material, PinnedEdge, Sheet, Solid, Timeline};
use simulator::vocabulary;

use crate::elastic::{MATERIALS, end, particle, resting, sheet};
use crate::support::{assert_table, update_docs};

const COMMAND: &str = "cargo test --release -p simulator --test it mesh";

/// Errors on meshes.
struct Curve {
    title: &'static str,
    color: &'static str,
    points: Vec<Point>,
}

struct Point {
    /// Cells or bars along the length.
    cells: usize,
    /// Length of one.
    h: f64,
    error: f64,
}

impl Curve {
    fn new(
        (title, color): (&'static str, &'static str),
        meshes: &[usize],
        error: impl Fn(usize) -> f64,
    ) -> Self {
        let point = |cells: usize| Point { cells, h: 1.0 / cells as f64, error: error(cells) };
        Self { title, color, points: meshes.iter().map(|cells| point(*cells)).collect() }
    }

    /// The order between each mesh and the one before it.
    fn orders(&self) -> Vec<f64> {
        let order =
            |pair: &[Point]| (pair[0].error / pair[1].error).ln() / (pair[0].h / pair[1].h).ln();
        self.points.windows(2).map(order).collect()
    }

    #[track_caller]
    fn assert_order(&self, order: f64, tolerance: f64, last_error: f64) {
        let (errors, orders): (Vec<f64>, _) =
            (self.points.iter().map(|point| point.error).collect(), self.orders());
        let what = self.title;
        assert!(
            orders.iter().all(|each| (each - order).abs() < tolerance),
            "{what}: {errors:?} {orders:?}"
        );
        assert!(errors.last().is_some_and(|error| *error < last_error), "{what}: {errors:?}");
    }
}

/// How far above the ends of soft springs are, whose pull is constant.
const FAR: f64 = 1e6;

/// A force along y on a particle at `x`, by a spring to the fixed particle `far`.
fn load(on: usize, x: f64, force: f64, far: usize) -> String {
    let alpha = force / FAR;
    particle(x, FAR, 1.0, true)
        + &format!(r#"<elasticbodyspringforce i1="{on}" i2="{far}" alpha="{alpha:?}" l0="1"/>"#)
}

/// The relative error of the deflection under a load at its end of a rod of `n` bars beyond its fixed bar. The rod begins in
/// the middle of the fixed bar.
fn error_of_a_rod(n: usize) -> f64 {
    let (length, alpha, force) = (1.0, 2.0, 1e-4);
    let h = bar(n);
    let mut text = String::new();
    for i in 0..n + 2 {
        text += &particle(h * (i as f64 - 0.5), 0.0, 1.0, i < 2);
    }
    for i in 0..n + 1 {
        let j = i + 1;
        text += &format!(r#"<elasticbodyspringforce i1="{i}" i2="{j}" alpha="1e5" l0="{h:?}"/>"#);
    }
    for i in 0..n {
        let (j, k) = (i + 1, i + 2);
        text += &format!(
            r#"<elasticbodybendingforce i1="{i}" i2="{j}" i3="{k}" alpha="{alpha:?}" theta0="0"/>"#
        );
    }
    text += &load(n + 1, length, force, n + 2);
    let expected = force * length * length * length / (3.0 * 0.5 * alpha);
    (end(&resting(&text))[2 * (n + 1) + 1] / expected - 1.0).abs()
}

/// The length of a bar of a rod of length 1: the half bar counts.
fn bar(n: usize) -> f64 {
    1.0 / (n as f64 + 0.5)
}

/// The length of a sheet of length 1 and weight 1, Young's modulus 4, that hangs from one side: `∫ λ dX`, with
/// the stress `2 λ (λ² − 1) = 1 − X`.
fn length_of_a_hanging_sheet() -> f64 {
    let stretch = |load: f64| {
        let mut stretch = 1.0;
        for _ in 0..50 {
            let (value, slope): (f64, f64) =
                (2.0 * stretch * (stretch * stretch - 1.0), 6.0 * stretch * stretch - 2.0);
            stretch -= (value - load) / slope;
        }
        stretch
    };
    // Simpson's rule.
    let n = 2000;
    let weight = |i: i32| match i {
        0 | 2000 => 1.0,
        i if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=n).map(|i| weight(i) * stretch(f64::from(i) / f64::from(n))).sum::<f64>()
        / (3.0 * f64::from(n))
}

/// The length of such a sheet of `n` by 2 cells.
fn length_of_cells(tag: &str, modulus: f64, n: usize) -> f64 {
    let elements =
        sheet(tag, [1.0, 1.0], [n, 2], modulus, 0.0) + r#"<simplegravity fx="1" fy="0"/>"#;
    end(&resting(&elements))[2 * n]
}

/// A plane problem, whose exact displacement is known.
struct Problem {
    /// At a point, for the length 1 and these values of `D`, `E` and `ν`.
    displacement: fn([f64; 2]) -> [f64; 2],
    /// Loads a sheet of these cells.
    load: fn(&mut Scene, [usize; 2]),
}

const DEPTH: f64 = 0.25;
const YOUNG: f64 = 4.0;
const NU: f64 = 0.3;
const INERTIA: f64 = DEPTH * DEPTH * DEPTH / 12.0;

/// `P`, and `γ`.
const LOAD: f64 = 1e-7;

const WEIGHT: Problem = Problem {
    displacement: |[x, y]| {
        let scale = LOAD / YOUNG;
        [scale * (x - 0.5 * x * x - 0.5 * NU * y * y), -scale * NU * (1.0 - x) * y]
    },
    // A square metre weighs 1.
    load: |scene, _| element(scene, "simplegravity", &[], &[("fx", LOAD)]),
};

const SHEAR: Problem = Problem {
    displacement: |[x, y]| {
        let scale = LOAD / (6.0 * YOUNG * INERTIA);
        let (height, rest) = (y * y - 0.25 * DEPTH * DEPTH, 1.0 - x);
        let along = -y * ((6.0 - 3.0 * x) * x + (2.0 + NU) * height);
        let across = 3.0 * NU * y * y * rest
            + (4.0 + 5.0 * NU) * DEPTH * DEPTH * x / 4.0
            + (3.0 - x) * x * x;
        [scale * along, scale * across]
    },
    load: |scene, [nx, ny]| {
        let h = DEPTH / ny as f64;
        let stress = |y: f64| LOAD / (2.0 * INERTIA) * (0.25 * DEPTH * DEPTH - y * y);
        for j in 0..=ny {
            let y = h * j as f64 - 0.5 * DEPTH;
            // Simpson's rule on each half of the hat function, which is 1/2 in the middle.
            let half = |to: f64| h / 6.0 * (stress(y) + 2.0 * stress(y + 0.5 * to));
            let force = if j > 0 { half(-h) } else { 0.0 } + if j < ny { half(h) } else { 0.0 };
            let on = j * (nx + 1) + nx;
            let mut far = scene.particles[on].clone();
            (far.position[1], far.fixed) = (FAR, true);
            scene.particles.push(far);
            let spring = [on, scene.particles.len() - 1];
            let given = [("alpha", force / FAR), ("l0", 1.0)];
            element(scene, "elasticbodyspringforce", &spring, &given);
        }
    },
};

fn element(scene: &mut Scene, tag: &str, particles: &[usize], given: &[(&str, f64)]) {
    let schema = vocabulary().force(tag).unwrap();
    scene.forces.push(ForceElement::new(schema, particles, None, schema.values(given)));
}

/// The error on a mesh of `n` cells along the length, relative to the displacement: root mean squares over the free particles.
fn error_of_a_sheet(problem: &Problem, (tag, share): (&str, f64), n: usize) -> f64 {
    let vocabulary = vocabulary();
    let cells = [n, n / 4];
    let [nx, ny] = cells.map(|count| count as u64);
    let sheet = Sheet {
        nx,
        ny,
        width: 1.0,
        height: DEPTH,
        pinned: PinnedEdge::Left,
        stretch: 1.0,
        gravity: 0.0,
        material: Material {
            force: vocabulary.force(tag).unwrap(),
            youngs_modulus: YOUNG * share,
            poisson_ratio: NU,
            density: 1.0,
        },
        timeline: to_rest(),
    };
    let mut scene = sheet.scene().unwrap();
    let n_particles = scene.particles.len();
    (problem.load)(&mut scene, cells);
    let expected = scene.particles[..n_particles].iter().map(|particle| {
        let [x, y, _] = particle.position;
        (problem.displacement)([x, y - 0.5 * DEPTH])
    });
    error_at_rest(&expected.collect::<Vec<_>>(), scene)
}

/// Few steps, much longer than any period.
fn to_rest() -> Timeline {
    Timeline {
        integrator: vocabulary().integrator("implicit-euler").unwrap(),
        options: Vec::new(),
        time_step: Some(1000.0),
        duration: 0.0,
        steps: Some(12),
    }
}

/// The error of the displacements of the first particles, those of fixed particles given: these have none, and do not count.
fn error_at_rest<const D: usize>(expected: &[[f64; D]], mut scene: Scene) -> f64 {
    let start = scene.positions();
    for (particle, by) in scene.particles.iter_mut().zip(expected).filter(|(p, _)| p.fixed) {
        (0..D).for_each(|axis| particle.position[axis] += by[axis]);
    }
    let end = end(&scene);
    let moved = end.iter().zip(start).map(|(now, start)| now - start);
    let is_free = |place: &usize| !scene.particles[place / D].fixed;
    let values = moved.zip(expected.as_flattened()).enumerate();
    let [mut error, mut size] = [0.0, 0.0];
    for (_, (moved, is)) in values.filter(|(place, _)| is_free(place)) {
        error += (moved - is).powi(2);
        size += is * is;
    }
    (error / size).sqrt()
}

/// The error of a cube of `n` cells along each side.
fn error_of_a_cube(tag: &str, n: usize) -> f64 {
    let side = n as u64;
    let block = Block {
        nx: side,
        ny: side,
        nz: side,
        length: 1.0,
        height: 1.0,
        depth: 1.0,
        pinned: PinnedEdge::Left,
        stretch: 1.0,
        gravity: 0.0,
        solid: Solid {
            force: vocabulary().force(tag).unwrap(),
            youngs_modulus: YOUNG,
            poisson_ratio: NU,
            density: 1.0,
        },
        timeline: to_rest(),
    };
    let mut scene = block.scene().unwrap();
    for particle in &mut scene.particles {
        let [x, y, z] = particle.position;
        particle.fixed = [x - 0.5, y, z].iter().any(|place| place.abs() > 0.5 - 1e-9);
    }
    let (p, q, r) = (2.0, 1.5, 2.5);
    let expected = scene.particles.iter().map(|particle| {
        let [x, y, z] = particle.position;
        let ((sx, cx), (sy, cy)) = ((p * x).sin_cos(), (q * y).sin_cos());
        let (sz, cz) = ((r * z).sinh(), (r * z).cosh());
        [-p * sx * cy * cz, -q * cx * sy * cz, r * cx * cy * sz].map(|slope| LOAD * slope)
    });
    error_at_rest(&expected.collect::<Vec<_>>(), scene)
}

/// The error of a simply supported plate, an equilateral triangle of side 1, with `n` triangles along each side.
fn error_of_a_plate(n: usize) -> f64 {
    let (height, stiffness) = (0.75_f64.sqrt(), 0.5);
    let mut scene =
        Scene::new("plate", Dimension::Three, vocabulary().integrator("implicit-euler").unwrap());
    (scene.time_step, scene.duration) = (1000.0, 12000.0);
    let mut numbers = BTreeMap::new();
    for (j, i) in (0..=n).flat_map(|j| (0..=n - j).map(move |i| (j, i))) {
        numbers.insert([i, j], scene.particles.len());
        let side = n as f64;
        scene.particles.push(Particle {
            mass: 0.0,
            position: [(i as f64 + 0.5 * j as f64) / side, height * j as f64 / side, 0.0],
            velocity: [0.0; 3],
            fixed: i == 0 || j == 0 || i + j == n,
            radius: 0.1,
            tag: None,
        });
    }
    let upward = |[i, j]: [usize; 2]| [[i, j], [i + 1, j], [i, j + 1]];
    let downward = |[i, j]: [usize; 2]| [[i + 1, j], [i + 1, j + 1], [i, j + 1]];
    let triangles: Vec<[usize; 3]> = numbers
        .keys()
        .flat_map(|cell| [upward(*cell), downward(*cell)])
        .filter_map(|corners| {
            let [a, b, c] = corners.map(|corner| numbers.get(&corner).copied());
            Some([a?, b?, c?])
        })
        .collect();
    // Of each side, the third corners of its triangles.
    let mut sides: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
    for [a, b, c] in &triangles {
        let given = [("youngsmodulus", 1.0), ("poissonratio", NU)];
        let schema = vocabulary().force("stvktriangle").unwrap();
        let mut parameters = schema.values(&given);
        for (value, parameter) in parameters.iter_mut().zip(schema.parameters) {
            if let Some(at) = parameter.coordinate {
                *value = scene.particles[[*a, *b, *c][at.particle]].position[at.axis];
            }
        }
        scene.forces.push(ForceElement::new(schema, &[*a, *b, *c], None, parameters));
        for (one, other, third) in [(a, b, c), (b, c, a), (c, a, b)] {
            scene.particles[*third].mass += height / (6.0 * (n * n) as f64);
            sides.entry([*one.min(other), *one.max(other)]).or_default().push(*third);
        }
    }
    for ([i, j], thirds) in &sides {
        if let [k, l] = thirds[..] {
            let given = [("stiffness", stiffness), ("theta0", 0.0)];
            element(&mut scene, "hingebendingforce", &[*i, *j, k, l], &given);
        }
    }
    element(&mut scene, "simplegravity", &[], &[("fz", PRESSURE)]);
    let expected = scene.particles.iter().map(|particle| {
        let [across, along, _] = particle.position;
        let (a, x, y) = (height, along - height / 3.0, across - 0.5);
        let squared = x * x + y * y;
        let shape = x * x * x - 3.0 * x * y * y - a * squared + 4.0 / 27.0 * a * a * a;
        let scale = PRESSURE / (64.0 * a * 6.0 * stiffness);
        [0.0, 0.0, scale * shape * (4.0 / 9.0 * a * a - squared)]
    });
    error_at_rest(&expected.collect::<Vec<_>>(), scene)
}

/// The load of a square metre of a plate, which weighs 1.
const PRESSURE: f64 = 1e-4;

fn rod() -> Curve {
    let names = ("cantilever of hinges, against Euler and Bernoulli", "#0a5aa0");
    let mut curve = Curve::new(names, &[4, 8, 16, 32, 64], error_of_a_rod);
    curve.points.iter_mut().for_each(|point| point.h = bar(point.cells));
    curve
}

fn hanging_sheet(tag: &str, modulus: f64) -> Curve {
    let expected = length_of_a_hanging_sheet();
    let names = ("hung sheet, stretched by up to 20 %, ν = 0", "#b34700");
    Curve::new(names, &[4, 8, 16, 32], |n| (length_of_cells(tag, modulus, n) - expected).abs())
}

fn stretched_sheet(material: (&str, f64)) -> Curve {
    let names = ("sheet under its weight, plane stress, ν = 0.3", "#00735a");
    Curve::new(names, &[16, 32, 64, 128], |n| error_of_a_sheet(&WEIGHT, material, n))
}

fn cantilever(material: (&str, f64)) -> Curve {
    let names = ("cantilever of triangles, against Timoshenko", "#7b2d8e");
    Curve::new(names, &[16, 32, 64, 128], |n| error_of_a_sheet(&SHEAR, material, n))
}

fn cube(tag: &str) -> Curve {
    let names = ("cube of tetrahedra, displaced at its faces, ν = 0.3", "#8a6d00");
    Curve::new(names, &[4, 8, 16], |n| error_of_a_cube(tag, n))
}

fn plate() -> Curve {
    let names = ("plate of hinges, simply supported, against Kirchhoff", "#b3005e");
    Curve::new(names, &[6, 12, 24, 48], error_of_a_plate)
}

#[test]
fn a_cube_of_tetrahedra_converges_to_the_closed_form() {
    cube("stvktetrahedron").assert_order(2.0, 0.2, 1e-2);
    // Small strains are linear.
    let errors = ["stvktetrahedron", "corotatedtetrahedron", "neohookeantetrahedron"]
        .map(|tag| error_of_a_cube(tag, 4));
    assert!(errors.iter().all(|error| (error / errors[0] - 1.0).abs() < 1e-5), "{errors:?}");
}

#[test]
fn a_plate_of_hinges_converges_to_kirchhoff() {
    plate().assert_order(2.0, 0.2, 1e-2);
}

#[test]
fn a_cantilever_of_hinges_converges_to_euler_and_bernoulli() {
    rod().assert_order(2.0, 0.1, 1e-4);
}

#[test]
fn a_hanging_sheet_converges_to_the_closed_form() {
    for (tag, modulus) in [("elasticbodycstforce", 1.0), ("stvktriangle", 4.0)] {
        hanging_sheet(tag, modulus).assert_order(2.0, 0.1, 1e-4);
    }
    // That of the corotated material is `4 (λ − 1) = 1 − X`, which is linear: every mesh meets `1 + 1/8` at its nodes.
    let errors = [4, 8, 16].map(|n| (length_of_cells("corotatedtriangle", 4.0, n) - 1.125).abs());
    assert!(errors.iter().all(|error| *error < 1e-10), "{errors:?}");
}

#[test]
fn a_stretched_sheet_converges_to_plane_stress() {
    for material in MATERIALS {
        stretched_sheet(material).assert_order(2.0, 0.2, 1e-3);
    }
}

#[test]
fn a_cantilever_of_triangles_converges_to_timoshenko() {
    for material in MATERIALS {
        cantilever(material).assert_order(2.0, 0.2, 1e-2);
    }
}

#[test]
fn table_and_picture_of_convergence_match_the_code() {
    let material = MATERIALS[1];
    let curves = [
        rod(),
        hanging_sheet(material.0, YOUNG),
        stretched_sheet(material),
        cantilever(material),
        cube("stvktetrahedron"),
        plate(),
    ];
    let titles = curves.iter().map(|curve| curve.title).collect::<Vec<_>>().join(" | ");
    let mut table = format!("\n| cells | {titles} |\n| ---: |{}\n", " ---: |".repeat(curves.len()));
    let mut cells: Vec<usize> =
        curves.iter().flat_map(|curve| &curve.points).map(|point| point.cells).collect();
    cells.sort_unstable();
    cells.dedup();
    for cells in cells {
        write!(table, "| {cells} |").unwrap();
        for curve in &curves {
            let place = curve.points.iter().position(|point| point.cells == cells);
            let error = place.map(|place| format!("{:.1e}", curve.points[place].error));
            write!(table, " {} |", error.unwrap_or_default()).unwrap();
        }
        table.push('\n');
    }
    write!(table, "| order |").unwrap();
    for curve in &curves {
        write!(table, " {:.2} |", curve.orders().last().unwrap()).unwrap();
    }
    table.push('\n');
    assert_table("methods.md", "### Convergence in the mesh\n", &table, COMMAND);

    let svg = picture(&curves);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/pictures/mesh.svg");
    if update_docs() {
        fs::write(&path, &svg).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    assert!(kept == svg, "docs/pictures/mesh.svg is out of date; `UPDATE_DOCS=1 {COMMAND}`");
}

/// Errors by cells, both logarithmic, and the slope of order 2.
fn picture(curves: &[Curve]) -> String {
    // Pixels: a factor of 2 along x, and of 10 along y.
    let (left, top, octave, decade, decades) = (70.0, 150.0, 85.0, 50.0, 6);
    let (width, height) = (6.0 * octave, f64::from(decades) * decade);
    let at = |cells: f64, error: f64| {
        [left + octave * (cells / 3.0).log2(), top - decade * (error).log10()]
    };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 600 500\" font-family=\"sans-serif\" font-size=\"13\" fill=\"#1b1f24\">\n\
         <title>Errors by the number of cells along the length</title>\n<rect width=\"600\" height=\"500\" fill=\"#fff\"/>\n\
         <rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#57606a\"/>\n"
    );
    for decade in 0..=decades {
        let [_, y] = at(3.0, 10.0_f64.powi(-decade));
        writeln!(
            svg,
            "<path d=\"M{left} {y:.1}h{width}\" stroke=\"#e6e9ed\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            left - 8.0,
            y + 4.5,
            if decade == 0 { "1".into() } else { format!("1e-{decade}") }
        )
        .unwrap();
    }
    for cells in [4, 8, 16, 32, 64, 128] {
        let [x, _] = at(f64::from(cells), 1.0);
        let y = top + height + 18.0;
        writeln!(svg, "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{cells}</text>")
            .unwrap();
    }
    let [[x1, y1], [x2, y2]] = [at(16.0, 0.3), at(64.0, 0.3 / 16.0)];
    writeln!(
        svg,
        "<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"#57606a\" stroke-dasharray=\"5 4\"/>\
         <text x=\"{x2:.1}\" y=\"{:.1}\" text-anchor=\"end\">order 2</text>",
        y2 - 26.0
    )
    .unwrap();
    for (number, Curve { title, color, points }) in curves.iter().enumerate() {
        let points: Vec<String> = points
            .iter()
            .map(|point| at(point.cells as f64, point.error))
            .map(|[x, y]| format!("{x:.1},{y:.1}"))
            .collect();
        let y = 24.0 + 20.0 * number as f64;
        writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>\n\
             <path d=\"M{left} {:.1}h28\" stroke=\"{color}\" stroke-width=\"3\"/><text x=\"{}\" y=\"{y}\">{title}</text>",
            points.join(" "),
            y - 4.5,
            left + 36.0
        )
        .unwrap();
    }
    svg + "</svg>\n"
}
