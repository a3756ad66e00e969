//! The cost of mistakes: the points that each loses, by group of scenes.

use std::collections::BTreeMap;
use std::fmt::Write;

use diagnosis::findings::{Feature, Part};
use grader::suite::{Case, Section};
use selftest::mistake::Mistake;

use super::findings::Inputs;
use super::table::{Row, Table, capitalized};

/// Groups of the course's scenes, in the order in which its hand-outs introduce what they test.
const GROUPS: [&str; 8] = [
    "Inertia",
    "SimpleGravity",
    "Spring",
    "SpringDamping",
    "Gravitational",
    "LinearDrag",
    "FixedParticles",
    "Combined",
];

const ASSIGNMENTS: [&str; 2] = ["t1m2", "t1m3"];

/// A number for each of the [`GROUPS`].
type ByGroup = [f64; GROUPS.len()];

fn place(group: &str) -> Option<usize> {
    GROUPS.iter().position(|name| *name == group)
}

/// The group that tests a part of a force.
fn group_of(part: Part) -> Option<usize> {
    place(match part {
        Part::One("springforce", "damping") => "SpringDamping",
        part => match part.tag() {
            "simplegravity" => "SimpleGravity",
            "springforce" => "Spring",
            "gravitationalforce" => "Gravitational",
            "dragdamping" => "LinearDrag",
            _ => return None,
        },
    })
}

/// The group that tests where a mistake was made; `None` for methods, which every scene needs.
fn own_group(mistake: &Mistake) -> Option<usize> {
    match mistake.feature() {
        Feature::Force(part) | Feature::Jacobian(part) => group_of(part),
        Feature::Fixed(_) => place("FixedParticles"),
        _ => None,
    }
}

/// Points of the required scenes of each group that catch a mistake.
fn cost(row: &Row, inputs: &Inputs) -> ByGroup {
    let required = |case: &&Case| case.feature.section == Section::Required;
    let mut weights: BTreeMap<_, [f64; 2]> = BTreeMap::new();
    for case in inputs.suite.cases.iter().filter(required) {
        let [failed, all] = weights.entry(&case.feature).or_default();
        let weight = inputs.rubric.weight(case);
        *all += weight;
        if row.caught_by.contains(&case.id) {
            *failed += weight;
        }
    }
    let mut cost = ByGroup::default();
    for (feature, [failed, all]) in weights {
        let group = place(&feature.group).expect("a group of the course");
        cost[group] += inputs.rubric.points(feature) * failed / all;
    }
    cost
}

/// The average cost of the mistakes with one subject.
struct Costs {
    subject: &'static str,
    own: Option<usize>,
    n_mistakes: usize,
    sum: ByGroup,
}

impl Costs {
    /// Costs of the mistakes that cost anything, by subject.
    fn of(table: &Table, inputs: &Inputs) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for row in &table.rows {
            let cost = cost(row, inputs);
            if cost == ByGroup::default() {
                continue;
            }
            let (subject, own) = (row.mistake.subject, own_group(&row.mistake));
            if all.last().is_none_or(|last| (last.subject, last.own) != (subject, own)) {
                all.push(Self { subject, own, n_mistakes: 0, sum: ByGroup::default() });
            }
            let last = all.last_mut().expect("just added");
            last.n_mistakes += 1;
            for (sum, cost) in last.sum.iter_mut().zip(cost) {
                *sum += cost;
            }
        }
        all
    }

    fn markdown(&self) -> String {
        let mut text = format!("| {} | {} |", capitalized(self.subject), self.n_mistakes);
        for (group, sum) in self.sum.iter().enumerate() {
            let points = format!("{:.1}", sum / self.n_mistakes as f64);
            let cell = if *sum == 0.0 {
                " |".to_owned()
            } else if self.own == Some(group) {
                format!(" **{points}** |")
            } else {
                format!(" {points} |")
            };
            text += &cell;
        }
        text + "\n"
    }
}

/// Shares of the lost points in a mistake's own group, in groups before it and in groups after it. Methods have no own
/// group.
fn shares(costs: &[Costs]) -> [f64; 3] {
    let mut shares = [0.0; 3];
    for costs in costs {
        for (group, sum) in costs.sum.iter().enumerate() {
            let Some(own) = costs.own else { continue };
            shares[match group.cmp(&own) {
                std::cmp::Ordering::Equal => 0,
                std::cmp::Ordering::Less => 1,
                std::cmp::Ordering::Greater => 2,
            }] += sum;
        }
    }
    let all: f64 = shares.iter().sum();
    shares.map(|share| share / all)
}

/// The part of `docs/mistakes.md` about points.
pub(crate) fn markdown(table: &Table) -> String {
    let mut text = "\n## What a mistake costs\n\n\
        A scene holds what its group tests and what the groups to the left of it test, so that a mistake costs points of its\n\
        own group, in bold, and of groups that build on it, to the right. Points are those of required scenes, on average over\n\
        the mistakes that cost any.\n"
        .to_owned();
    for name in ASSIGNMENTS {
        let costs = Costs::of(table, &Inputs::of(name));
        let [own, before, after] = shares(&costs).map(|share| 100.0 * share);
        let _ = write!(
            text,
            "\n### `{name}`\n\n\
             Of the points that mistakes in forces, Jacobians and fixed particles cost, {own:.0} % are of their own group, {after:.0} % of\n\
             groups that build on it, and {before:.0} % of others.\n\n\
             | mistakes in | number | {} |\n| --- | ---: |{}\n",
            GROUPS.join(" | "),
            " ---: |".repeat(GROUPS.len())
        );
        text.extend(costs.iter().map(Costs::markdown));
    }
    text
}

#[test]
fn required_scenes_hold_only_what_their_group_and_earlier_ones_test() {
    for name in ["t1m1", "t1m2", "t1m3"] {
        let inputs = Inputs::of(name);
        for case in inputs.suite.cases.iter().filter(|c| c.feature.section == Section::Required) {
            let group = place(&case.feature.group).expect("a group of the course");
            let parts = case.scene.forces.iter().flat_map(|force| {
                Part::of(force.schema).into_iter().filter(|part| part.is_in(force))
            });
            let is_fixed = case.scene.particles.iter().any(|particle| particle.fixed);
            let fixed = is_fixed.then(|| place("FixedParticles").expect("a group"));
            let latest = parts.filter_map(group_of).chain(fixed).max().unwrap_or(0);
            assert!(latest <= group, "{} holds what {} tests", case.id, GROUPS[latest]);
        }
    }
}
