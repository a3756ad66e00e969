//! The engine on functions whose Jacobians are right, and on the same with a mistake.

use jacobian::likeness::{Change, Region};
use jacobian::structure::Property;
use jacobian::verdict::{Reason, Verdict};
use jacobian::{Derivative, Domain, Function, Report, Settings, Triplet, check};

type Values = fn(&[f64]) -> Vec<f64>;

/// A check of `jacobian`, row by row, as the derivative of `value`.
fn checked(
    value: impl Fn(&[f64]) -> Vec<f64>,
    jacobian: impl Fn(&[f64]) -> Vec<f64>,
    [rows, columns]: [usize; 2],
    settings: &Settings,
) -> Report {
    let fill = |x: &[f64], values: &mut [f64]| {
        values.copy_from_slice(&value(x));
        true
    };
    let dense = |x: &[f64], values: &mut [f64]| {
        values.copy_from_slice(&jacobian(x));
        true
    };
    let derivative = Derivative::Dense(Box::new(dense));
    check(&mut Function::new(rows, columns, Box::new(fill), derivative), settings)
}

fn at(points: &[&[f64]]) -> Settings {
    Settings { points: points.iter().map(|x| x.to_vec()).collect(), ..Settings::default() }
}

fn in_box(n: usize, width: f64) -> Settings {
    let domain = Domain { lower: vec![-width; n], upper: vec![width; n] };
    Settings { domain: Some(domain), ..Settings::default() }
}

/// Three values of three variables: no symmetry, every entry different.
const CUBIC: Values =
    |x| vec![x[0] * x[1], x[1] * x[2] + x[0].sin(), x[0] * x[0] * x[2] + x[1].exp()];
const SLOPES: Values =
    |x| vec![x[1], x[0], 0.0, x[0].cos(), x[2], x[1], 2.0 * x[0] * x[2], x[1].exp(), x[0] * x[0]];
const POINT: [f64; 3] = [0.7, -1.3, 0.9];

#[test]
fn a_right_jacobian_is_correct_and_the_remainder_falls_as_the_square() {
    let report = checked(CUBIC, SLOPES, [3, 3], &in_box(3, 2.0));
    assert_eq!(report.verdict, Verdict::Correct, "{report}");
    assert!(report.bound < 1e-9 && report.likeness.is_none(), "{report}");
    assert!((report.window.unwrap().slope - 2.0).abs() < 0.1, "{report}");
    assert_eq!(report, checked(CUBIC, SLOPES, [3, 3], &in_box(3, 2.0)));
}

#[test]
fn each_mistake_is_called_wrong_and_named() {
    type Edit = fn(&mut Vec<f64>);
    let cases: [(Edit, Region, Change); 9] = [
        (|j| j.iter_mut().for_each(|j| *j = -*j), Region::All, Change::Negative),
        (
            |j| j.iter_mut().for_each(|j| *j *= 0.5),
            Region::All,
            Change::Factor(0.5, Some("½".into())),
        ),
        (
            |j| j.iter_mut().for_each(|j| *j *= 9e-4),
            Region::All,
            Change::Factor(9e-4, Some("h²".into())),
        ),
        (|j| j.fill(0.0), Region::All, Change::Missing),
        (|j| *j = (0..9).map(|k| j[k % 3 * 3 + k / 3]).collect(), Region::All, Change::Transposed),
        (|j| j[6..].fill(0.0), Region::Row(2), Change::Missing),
        (|j| j[2] = 1e-3, Region::Entry(0, 2), Change::Extra),
        (
            |j| (0..3).for_each(|r| j.swap(3 * r, 3 * r + 2)),
            Region::All,
            Change::ColumnsExchanged(0, 2),
        ),
        (|j| j[4] = f64::NAN, Region::Entry(1, 1), Change::NotFinite),
    ];
    for (edit, region, change) in cases {
        let edited = |x: &[f64]| {
            let mut j = SLOPES(x);
            edit(&mut j);
            j
        };
        let factors = vec![("h".to_owned(), 0.03)];
        let report = checked(CUBIC, edited, [3, 3], &Settings { factors, ..at(&[&POINT]) });
        assert_eq!(report.verdict, Verdict::Wrong, "{change:?}");
        let likeness = report.likeness.clone().unwrap();
        let same = match (&likeness.change, &change) {
            (Change::Factor(_, found), Change::Factor(_, name)) => found == name,
            (found, expected) => found == expected,
        };
        let region_is = likeness.region == region || matches!(change, Change::ColumnsExchanged(..));
        assert!(same && region_is, "{likeness:?}, expected {region:?} {change:?}");
    }
}

#[test]
fn a_single_entry_off_by_a_millionth_is_found_and_by_its_noise_is_not() {
    let off = |by: f64| {
        checked(
            CUBIC,
            |x| {
                let mut j = SLOPES(x);
                j[3] *= 1.0 + by;
                j
            },
            [3, 3],
            &at(&[&POINT]),
        )
    };
    assert_eq!(off(1e-6).wrong.into_iter().collect::<Vec<_>>(), [(1, 0)]);
    assert_eq!(off(1e-16).verdict, Verdict::Correct);
}

#[test]
fn kinks_jumps_and_undefined_points_are_said_and_accuse_nobody() {
    let kink = checked(|x| vec![x[0].abs()], |x| vec![x[0].signum()], [1, 1], &at(&[&[0.0]]));
    assert_eq!(kink.verdict, Verdict::Inconclusive(Reason::Kink));
    assert_eq!([kink.states[0].kinks, kink.states[0].jumps], [1, 0]);
    let jump = checked(|x| vec![x[0].floor() + x[0]], |_| vec![1.0], [1, 1], &at(&[&[2.0]]));
    assert_eq!([jump.states[0].kinks, jump.states[0].jumps], [0, 1], "{jump}");
    let nowhere = checked(|_| vec![f64::NAN], |_| vec![1.0], [1, 1], &at(&[&[2.0]]));
    assert_eq!(nowhere.verdict, Verdict::Inconclusive(Reason::Degenerate));
    // Next to the kink, one other point decides.
    let both =
        checked(|x| vec![x[0].abs()], |x| vec![x[0].signum()], [1, 1], &at(&[&[0.0], &[0.3]]));
    assert_eq!(both.verdict, Verdict::Correct, "{both}");
}

#[test]
fn single_precision_is_recognised() {
    let value = |x: &[f64]| vec![f64::from((x[0] as f32).sin())];
    let report = checked(value, |x| vec![f64::from((x[0] as f32).cos())], [1, 1], &in_box(1, 1.0));
    assert_eq!(report.verdict, Verdict::Correct, "{report}");
    assert_eq!(report.single, [true, true], "{report}");
    let wrong = checked(value, |x| vec![1.01 * x[0].cos()], [1, 1], &in_box(1, 1.0));
    assert_eq!(wrong.verdict, Verdict::Wrong, "{wrong}");
}

#[test]
fn each_coordinate_is_rounded_to_its_own_distance() {
    // In single precision the first coordinate is rounded to multiples of 6e-5, the second to multiples of 1e-10.
    let rounded = |x: &[f64]| x.iter().map(|x| f64::from(*x as f32)).collect::<Vec<_>>();
    let value = |x: &[f64]| {
        let x = rounded(x);
        rounded(&[x[0].sin() + x[1], x[0] * x[1]])
    };
    let check = |factor: f64| {
        let jacobian = |x: &[f64]| {
            let x = rounded(x);
            rounded(&[factor * x[0].cos(), 1.0, x[1], x[0]])
        };
        let domain = Domain { lower: vec![999.0, -1.0], upper: vec![1002.0, 2.0] };
        let settings =
            Settings { domain: Some(domain), draws: 0, search: false, ..at(&[&[1000.3, 1e-3]]) };
        checked(value, jacobian, [2, 2], &settings)
    };
    assert_ne!(check(1.0).verdict, Verdict::Wrong, "{}", check(1.0));
    assert_eq!(check(1.1).wrong.into_iter().collect::<Vec<_>>(), [(0, 0)]);
}

/// A chain of springs with stiffness 1 between neighbours, as triplets.
fn chain(n: usize, spoilt: bool) -> (impl Fn(&[f64], &mut [f64]) -> bool, Vec<Triplet>) {
    let value = move |x: &[f64], values: &mut [f64]| {
        for k in 0..n {
            let left = if k > 0 { x[k - 1] } else { 0.0 };
            let right = if k + 1 < n { x[k + 1] } else { 0.0 };
            values[k] = left - 2.0 * x[k] + right - x[k].powi(3);
        }
        true
    };
    let neighbours = (0..n).flat_map(move |row| {
        let near = [row.wrapping_sub(1), row + 1].into_iter().filter(move |column| *column < n);
        near.map(move |column| Triplet { row, column, value: 1.0 })
    });
    let missing = move |t: &Triplet| !(spoilt && (t.row, t.column) == (n / 2, n / 2 + 1));
    (value, neighbours.filter(missing).collect())
}

#[test]
fn columns_of_a_sparse_jacobian_are_measured_together_and_a_missing_entry_is_found() {
    let n = 600;
    let x: Vec<f64> = (0..n).map(|k| (k as f64).sin()).collect();
    for spoilt in [false, true] {
        let (value, neighbours) = chain(n, spoilt);
        let sparse = |x: &[f64], triplets: &mut Vec<Triplet>| {
            triplets.extend(&neighbours);
            let own =
                |row: usize| Triplet { row, column: row, value: -2.0 - 3.0 * x[row] * x[row] };
            triplets.extend((0..n).map(own));
            true
        };
        let derivative = Derivative::Sparse(Box::new(sparse));
        let mut function = Function::new(n, n, Box::new(value), derivative);
        let report = check(&mut function, &at(&[&x]));
        if spoilt {
            assert_eq!(report.wrong.into_iter().collect::<Vec<_>>(), [(n / 2, n / 2 + 1)]);
        } else {
            assert_eq!(report.verdict, Verdict::Correct, "{report}");
        }
        assert!(report.calls.values < 1000, "{}", report.calls.values);
    }
}

#[test]
fn products_give_the_same_verdict_as_entries() {
    let value = |x: &[f64], values: &mut [f64]| {
        values.copy_from_slice(&CUBIC(x));
        true
    };
    let product = |x: &[f64], v: &[f64], values: &mut [f64]| {
        let j = SLOPES(x);
        for (row, value) in values.iter_mut().enumerate() {
            *value = (0..3).map(|column| j[3 * row + column] * v[column]).sum();
        }
        true
    };
    let derivative = Derivative::Product(Box::new(product));
    let report = check(&mut Function::new(3, 3, Box::new(value), derivative), &at(&[&POINT]));
    assert_eq!(report.verdict, Verdict::Correct, "{report}");
}

#[test]
fn properties_are_checked_on_request() {
    // A spring between two particles in the plane.
    let spring = |x: &[f64]| {
        let (dx, dy) = (x[2] - x[0], x[3] - x[1]);
        let square = dx * dx + dy * dy;
        vec![square * dx, square * dy, -square * dx, -square * dy]
    };
    let jacobian = |x: &[f64]| {
        let (dx, dy) = (x[2] - x[0], x[3] - x[1]);
        let [a, b, c] = [3.0 * dx * dx + dy * dy, 2.0 * dx * dy, dx * dx + 3.0 * dy * dy];
        vec![-a, -b, a, b, -b, -c, b, c, a, b, -a, -b, b, c, -b, -c]
    };
    let settings = Settings { properties: Property::ALL.into(), block: 2, ..in_box(4, 1.0) };
    let report = checked(spring, jacobian, [4, 4], &settings);
    assert!(report.properties.iter().all(|found| found.verdict == Verdict::Correct), "{report}");
    let held = |x: &[f64]| spring(x).iter().zip(x).map(|(f, x)| f - x).collect();
    let of_held = |x: &[f64]| {
        let mut j = jacobian(x);
        (0..4).for_each(|k| j[5 * k] -= 1.0);
        j
    };
    let report = checked(held, of_held, [4, 4], &settings);
    let verdicts: Vec<Verdict> = report.properties.iter().map(|found| found.verdict).collect();
    assert_eq!(verdicts, [Verdict::Correct, Verdict::Wrong, Verdict::Correct], "{report}");
}

/// The gradient and Hessian of `m(c) b` for two edges `u`, `v` at distance `w`: `c = |u × v|²`, `b = |w|²`, and a mollifier
/// `m = c/ε (2 − c/ε)` where the edges are almost parallel (`c < ε`), else 1. `cross` is the factor of the second of the two
/// products of gradients in the Hessian.
fn mollified(x: &[f64], epsilon: f64, cross: f64) -> (Vec<f64>, Vec<f64>) {
    let edge =
        |b: usize, a: usize| -> [f64; 3] { std::array::from_fn(|k| x[3 * b + k] - x[3 * a + k]) };
    let (u, v, w) = (edge(1, 0), edge(3, 2), edge(2, 0));
    let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (uu, vv, uv, b) = (dot(&u, &u), dot(&v, &v), dot(&u, &v), dot(&w, &w));
    let c = uu * vv - uv * uv;
    let (m, first, second) = if c < epsilon {
        (
            c / epsilon * (2.0 - c / epsilon),
            2.0 * (1.0 - c / epsilon) / epsilon,
            -2.0 / (epsilon * epsilon),
        )
    } else {
        (1.0, 0.0, 0.0)
    };
    let mut of_c = [0.0; 9];
    let mut of_b = [0.0; 9];
    let mut hessian = [[0.0; 9]; 9];
    for i in 0..3 {
        of_c[i] = 2.0 * (u[i] * vv - v[i] * uv);
        of_c[3 + i] = 2.0 * (v[i] * uu - u[i] * uv);
        of_b[6 + i] = 2.0 * w[i];
        for j in 0..3 {
            let same = f64::from(i == j);
            hessian[i][j] = 2.0 * (vv * same - v[i] * v[j]) * first * b;
            hessian[3 + i][3 + j] = 2.0 * (uu * same - u[i] * u[j]) * first * b;
            let mixed = 2.0 * (2.0 * u[i] * v[j] - v[i] * u[j] - uv * same) * first * b;
            hessian[i][3 + j] = mixed;
            hessian[3 + j][i] = mixed;
            hessian[6 + i][6 + j] = 2.0 * m * same;
        }
    }
    for i in 0..9 {
        for j in 0..9 {
            hessian[i][j] += second * b * of_c[i] * of_c[j];
            hessian[i][j] += first * (of_c[i] * of_b[j] + cross * of_b[i] * of_c[j]);
        }
    }
    // u, v and w by the four points.
    let points: [[f64; 4]; 3] =
        [[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0], [-1.0, 0.0, 1.0, 0.0]];
    let mut gradient = vec![0.0; 12];
    let mut matrix = vec![0.0; 144];
    for (p, q) in (0..12).flat_map(|p| (0..12).map(move |q| (p, q))) {
        for a in 0..3 {
            if q == 0 {
                let part = first * b * of_c[3 * a + p % 3] + m * of_b[3 * a + p % 3];
                gradient[p] += points[a][p / 3] * part;
            }
            for b in 0..3 {
                let weight = points[a][p / 3] * points[b][q / 3];
                matrix[12 * p + q] += weight * hessian[3 * a + p % 3][3 * b + q % 3];
            }
        }
    }
    (gradient, matrix)
}

#[test]
fn a_term_missing_on_a_branch_that_no_random_state_reaches_is_found() {
    let settings = |search| Settings { block: 3, search, ..in_box(12, 1.0) };
    let gradient = |x: &[f64]| mollified(x, 1e-3, 1.0).0;
    let with = |cross: f64| move |x: &[f64]| mollified(x, 1e-3, cross).1;
    let right = checked(gradient, with(1.0), [12, 12], &settings(true));
    assert_eq!(right.verdict, Verdict::Correct, "{right}");
    let blind = Settings { draws: 100, ..settings(false) };
    let drawn = checked(gradient, with(0.0), [12, 12], &blind);
    assert_eq!(drawn.verdict, Verdict::Correct, "random states reach the branch: {drawn}");
    let searched = checked(gradient, with(0.0), [12, 12], &settings(true));
    assert_eq!(searched.verdict, Verdict::Wrong, "{searched}");
    assert!(searched.is_on_branch(), "{searched}");
}

/// Positions by displacements from a state at rest: no arrangement of the displacements makes the edges parallel or short.
fn displaced(u: &[f64]) -> Vec<f64> {
    let rest = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.5, 0.95, 1.3, 0.5];
    u.iter().zip(rest).map(|(u, rest)| u + rest).collect()
}

#[test]
fn a_branch_that_no_arrangement_of_the_variables_reaches_is_found_by_default() {
    // One point in two thousand is on the branch. A term is missing there; or too large, by less than a probe's line shows, where
    // other entries are not zero. Without probes, eight of twenty seeds find it.
    for (seed, cross) in (1..=5).flat_map(|seed| [1.0, 0.0, 1.0001].map(|cross| (seed, cross))) {
        let gradient = |u: &[f64]| mollified(&displaced(u), 1e-3, 1.0).0;
        let hessian = |u: &[f64]| mollified(&displaced(u), 1e-3, cross).1;
        let settings = Settings { seed, ..in_box(12, 1.0) };
        let report = checked(gradient, hessian, [12, 12], &settings);
        let verdict = if cross == 1.0 { Verdict::Correct } else { Verdict::Wrong };
        assert_eq!(report.verdict, verdict, "{cross}: {report}");
        assert_eq!(report.is_on_branch(), cross != 1.0, "{cross}: {report}");
    }
}

#[test]
fn probes_stay_within_a_number_of_calls_and_accuse_no_chaos() {
    let calls = |n: usize, search| {
        let cubes = |x: &[f64]| x.iter().map(|x| x.powi(3)).collect();
        let slopes = |x: &[f64]| {
            let entry =
                |k: usize| if k.is_multiple_of(n + 1) { 3.0 * x[k % n] * x[k % n] } else { 0.0 };
            (0..n * n).map(entry).collect()
        };
        let report = checked(cubes, slopes, [n, n], &Settings { search, ..in_box(n, 1.0) });
        assert_eq!(report.verdict, Verdict::Correct, "{report}");
        report.calls.values + report.calls.jacobians
    };
    assert!(calls(2, true) < 50_000 && calls(300, true) < 20_000 && calls(300, false) < 12_000);
    // The logistic map, iterated until rounding hides the derivative.
    let step = |(y, slope): (f64, f64)| (3.99 * y * (1.0 - y), slope * 3.99 * (1.0 - 2.0 * y));
    let iterated = |x: f64| (0..35).fold((x, 1.0), |at, _| step(at));
    let value = |x: &[f64]| x.iter().map(|x| iterated(*x).0).collect();
    let slopes = |x: &[f64]| vec![iterated(x[0]).1, 0.0, 0.0, iterated(x[1]).1];
    let domain = Domain { lower: vec![0.1; 2], upper: vec![0.9; 2] };
    let settings = Settings { domain: Some(domain), ..Settings::default() };
    let report = checked(value, slopes, [2, 2], &settings);
    assert_ne!(report.verdict, Verdict::Wrong, "{report}");
}
