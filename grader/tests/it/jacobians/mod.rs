//! Plants mistakes in Jacobians and tests that the check finds them, without false alarms.
//!
//! [`mistake`] changes the Jacobians of a force in one place at a time. [`variant`] computes correct ones by other
//! formulas. [`property`] plants mistakes that no single block shows. The results are in `docs/jacobians.md`, which
//! `UPDATE_DOCS=1 cargo test --release -p grader jacobians` writes.

#[path = "../../../../simulator/tests/it/support/bending.rs"]
mod bending;
mod element;
mod mistake;
mod planted;
mod property;
mod stencil;
mod table;
mod variant;

use std::sync::LazyLock;
use test_support::assert_document;

use grader::white_box::{
    BlockKind, By, Config, JacobianCheck, Maker, Property, Reason, Subject, Verdict, check,
    check_forces, simulated,
};
use rayon::prelude::*;
use scene::{Dimension, Scene};
use simulator::force::{self, ForceKind};

use planted::{Planted, XD};

/// A subject of the check.
pub(crate) struct Named {
    pub(crate) force: &'static str,
    pub(crate) description: &'static str,
    /// In three dimensions only, though the force exists in two.
    pub(crate) in_space: bool,
}

/// A subject with its results, in two and in three dimensions, or in three only.
pub(crate) struct Judged {
    pub(crate) subject: Named,
    pub(crate) checks: Vec<JacobianCheck>,
}

static ORIGINALS: LazyLock<Vec<JacobianCheck>> =
    LazyLock::new(|| check_forces(Config::default(), |_| true));

static MISTAKES: LazyLock<Vec<Judged>> = LazyLock::new(|| {
    let mistakes = mistake::all();
    let judge_one = |mistake: &mistake::Mistake| {
        let named = Named {
            force: mistake.force,
            description: mistake.description,
            in_space: mistake.in_space,
        };
        let plant = mistake.plant;
        judge(named, &move |scene| Box::new(Planted::new(scene, plant)))
    };
    mistakes.par_iter().map(judge_one).collect()
});

static BROKEN: LazyLock<Vec<Judged>> = LazyLock::new(|| {
    let judge_one = |broken: &property::Broken| {
        let (force, description) = (broken.force, broken.description);
        let make = broken.make;
        let named = Named { force, description, in_space: false };
        judge(named, &move |scene| make(simulated(scene), scene))
    };
    property::all().par_iter().map(judge_one).collect()
});

static VARIANTS: LazyLock<Vec<Judged>> = LazyLock::new(|| {
    let judge_one = |variant: &variant::Variant| {
        let (force, description) = (variant.force, variant.description);
        let plant = variant.plant;
        let named = Named { force, description, in_space: false };
        judge(named, &move |scene| Box::new(Planted::new(scene, plant)))
    };
    variant::all().par_iter().map(judge_one).collect()
});

pub(crate) fn originals() -> &'static [JacobianCheck] {
    &ORIGINALS
}

pub(crate) fn mistakes() -> &'static [Judged] {
    &MISTAKES
}

pub(crate) fn broken() -> &'static [Judged] {
    &BROKEN
}

pub(crate) fn variants() -> &'static [Judged] {
    &VARIANTS
}

fn kind(tag: &str) -> &'static ForceKind {
    force::REGISTRY.iter().find(|kind| kind.schema.tag == tag).expect("a registered force")
}

fn judge(subject: Named, make: &Maker<'_>) -> Judged {
    let dimensions = [Dimension::Two, Dimension::Three];
    let kind = kind(subject.force);
    let is_there = |each: &&Dimension| {
        kind.schema.exists_in(**each) && (!subject.in_space || **each == Dimension::Three)
    };
    let dimensions = dimensions.iter().filter(is_there);
    let of = |dimension: &Dimension| {
        check(kind, *dimension, Config::default(), make).expect("a force with a law")
    };
    Judged { checks: dimensions.map(of).collect(), subject }
}

fn verdicts(check: &JacobianCheck) -> Vec<(&'static str, Verdict)> {
    let blocks = check.blocks.iter().map(|finding| (finding.kind.name(), finding.verdict));
    let properties =
        check.properties.iter().map(|finding| (finding.property.name(), finding.verdict));
    blocks.chain(properties).collect()
}

#[test]
fn every_block_of_every_force_is_correct_in_two_and_three_dimensions() {
    // dF/dx direct and cross, dF/dv direct and cross: whether each is zero by theory.
    let zero: [(&str, [bool; 4]); 20] = [
        ("simplegravity", [true; 4]),
        ("constantforce", [true; 4]),
        ("springforce", [false; 4]),
        ("gravitationalforce", [false, false, true, true]),
        ("dragdamping", [true, true, false, true]),
        ("vortexforce", [false; 4]),
        ("greenspringforce", [false, false, true, true]),
        ("windforce", [false, true, true, true]),
        ("scriptedspringforce", [false, false, true, true]),
        ("elasticbodyspringforce", [false, false, true, true]),
        ("elasticbodybendingforce", [false, false, true, true]),
        ("elasticbodycstforce", [false, false, true, true]),
        ("stvktriangle", [false; 4]),
        ("corotatedtriangle", [false; 4]),
        ("neohookeantriangle", [false; 4]),
        ("stvktetrahedron", [false; 4]),
        ("corotatedtetrahedron", [false; 4]),
        ("neohookeantetrahedron", [false; 4]),
        ("hingebendingforce", [false; 4]),
        ("massdamping", [true, true, false, true]),
    ];
    let in_plane = force::REGISTRY.iter().filter(|kind| kind.schema.exists_in(Dimension::Two));
    assert_eq!(originals().len(), force::REGISTRY.len() + in_plane.count());
    for check in originals() {
        let (_, zero) = zero.iter().find(|(tag, _)| *tag == check.tag).expect("a line a force");
        for (finding, zero) in check.blocks.iter().zip(zero) {
            let expected = if *zero { Verdict::CorrectZero } else { Verdict::Correct };
            let context = format!("{} {:?} {:?}", check.tag, check.dimension, finding.kind);
            assert_eq!(finding.verdict, expected, "{context}");
            assert_eq!(finding.undecided, 0, "{context}");
            assert!(2 * finding.evidence > check.states, "{context}: {}", finding.evidence);
            let exhibit = finding.exhibit.as_ref().expect("something was seen");
            // The differences are accurate enough to detect an error of a millionth. In a solid in one place, a corner's own
            // block is smaller than the others by many orders. The normals of slender triangles lose digits.
            let is_in_one_place = exhibit.state.name == "length nearly zero";
            let is_slender = exhibit.state.name.starts_with("nearly");
            let bound = match check.tag {
                // Damping shares the rounding of the elastic force, which is far larger in a body that is stretched far; in one
                // place, the damping is smaller by the square of its size.
                _ if is_in_one_place && finding.kind.by == By::Velocity => f64::INFINITY,
                _ if finding.kind.by == By::Velocity => 1e-5,
                "neohookeantetrahedron" if is_in_one_place => 1e-5,
                "hingebendingforce" if is_slender => 1e-3,
                _ => 1e-8,
            };
            let uncertainty = exhibit.relative_error().uncertainty;
            assert!(uncertainty < bound, "{context}, {}: {uncertainty:e}", exhibit.state.name);
        }
        assert!(check.is_pass(), "{}: {:?}", check.tag, verdicts(check));
    }
}

#[test]
fn every_mistake_is_called_wrong_in_the_blocks_it_spoils_and_in_no_other() {
    let mut faults = Vec::new();
    for (mistake, Judged { checks, .. }) in mistake::all().iter().zip(mistakes()) {
        for check in checks {
            for finding in &check.blocks {
                let spoilt = mistake.spoils.contains(&finding.kind);
                let expected = if spoilt {
                    finding.verdict == Verdict::Wrong
                } else {
                    finding.verdict.is_correct()
                };
                if !expected {
                    let (force, description) = (mistake.force, mistake.description);
                    let (block, verdict) = (finding.kind.name(), finding.verdict);
                    let dimension = check.dimension;
                    faults.push(format!(
                        "{force}, {description}, {dimension:?}: {block} {verdict:?}"
                    ));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn enough_mistakes_and_variants_are_planted_over_all_forces() {
    let planted = mistake::all();
    assert!(planted.len() >= 30 && variant::all().len() >= 10);
    for kind in force::REGISTRY {
        let tag = kind.schema.tag;
        assert!(planted.iter().any(|mistake| mistake.force == tag), "{tag}");
    }
    let mut names: Vec<_> = planted.iter().map(|each| (each.force, each.description)).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), planted.len());
}

#[test]
fn exhibit_points_at_the_wrong_entry() {
    let find = |description: &str| {
        let mut found = mistakes().iter();
        found.find(|judged| judged.subject.description == description).expect("it is planted")
    };
    let exhibit = |judged: &'static Judged, kind: BlockKind| {
        let mut found = judged.checks[0].blocks.iter();
        found
            .find(|finding| finding.kind == kind)
            .and_then(|finding| finding.exhibit.as_ref())
            .expect("what is wrong is shown")
    };
    // Entry (1, 0) of the matrix: the first particle's y by its own x.
    let one = exhibit(find("one entry of ∂F/∂x off by a millionth"), XD);
    assert_eq!((one.row, one.column, one.worst), (0, 0, 2));
    let relative = one.worst_entry().analytic / one.worst_entry().second.expect("an opinion").value;
    assert!((relative - 1.000001).abs() < 1e-9);

    let second = exhibit(find("only the second particle's own block off by a millionth"), XD);
    assert_eq!((second.row, second.column), (1, 1));
    let undamped = exhibit(find("only without damping: off by a millionth"), XD);
    assert_eq!(undamped.state.scene.forces[0].parameters[2], 0.0);
    assert!(undamped.state.name.starts_with("b = 0"));
    let backwards =
        exhibit(find("edges listed backwards: damping part of ∂F/∂x with the wrong sign"), XD);
    assert!(backwards.state.name.contains("backwards"), "{}", backwards.state.name);
}

#[test]
fn mistakes_outside_blocks_break_the_expected_properties() {
    for (broken, Judged { checks, .. }) in property::all().iter().zip(broken()) {
        for check in checks {
            let context = format!("{}, {}", broken.force, broken.description);
            for finding in &check.blocks {
                assert!(finding.verdict.is_correct(), "{context}: {:?}", verdicts(check));
            }
            let is_wrong = |property: &Property| {
                check.properties.iter().any(|finding| {
                    finding.property == *property && finding.verdict == Verdict::Wrong
                })
            };
            let wrong: Vec<Property> = Property::ALL.into_iter().filter(is_wrong).collect();
            assert_eq!(wrong, broken.breaks, "{context}, {:?}", check.dimension);
        }
    }
}

#[test]
fn no_correct_variant_is_ever_called_wrong() {
    for Judged { subject, checks } in variants() {
        for check in checks {
            let Named { force, description, .. } = subject;
            assert!(!check.is_wrong(), "{force}, {description}: {:?}", verdicts(check));
            // And the check had enough evidence.
            assert!(check.is_pass(), "{force}, {description}: {:?}", verdicts(check));
        }
    }
}

/// The verdicts on the blocks of a spring that `make` creates.
fn blocks(make: fn(&Scene) -> Box<dyn Subject>) -> Vec<Verdict> {
    let check = check(kind("springforce"), Dimension::Two, Config::default(), &make);
    check.expect("a force with a law").blocks.iter().map(|finding| finding.verdict).collect()
}

#[test]
fn a_kink_and_a_force_without_value_are_inconclusive() {
    let kinked = blocks(|scene| Box::new(property::Kinked::new(scene)));
    // The kink is in the first particle's force by its own position.
    assert_eq!(kinked[0], Verdict::Inconclusive(Reason::Kink));
    assert_eq!(kinked[1..], [Verdict::Correct; 3]);
    let undefined = blocks(|_| Box::new(property::Undefined));
    assert_eq!(undefined, [Verdict::Inconclusive(Reason::Degenerate); 4]);
}

#[test]
fn states_far_from_the_origin_and_nearly_degenerate_are_decided() {
    for check in originals() {
        for finding in check.blocks.iter().filter(|each| each.verdict == Verdict::Correct) {
            assert_eq!(finding.undecided, 0, "{} {:?}", check.tag, finding.kind);
        }
    }
}

#[test]
fn the_table_in_the_docs_is_up_to_date() {
    let command = "cargo test --release -p grader jacobians";
    assert_document("jacobians.md", &table::markdown(), command);
}
