//! Simulation of a large class on a cluster, and `docs/scale.md`, which holds its results.
//!
//! A discrete-event simulation: jobs start in the order of the array, in free slots; a job needs its start-up time, then
//! grades its submissions one after the other. The shards are those of the grader's own division. Three things go
//! wrong, independently: slow nodes, failing nodes, and jobs that are killed. A killed job is requeued; it keeps the
//! results that it has written, and loses the submission that it was grading.
//!
//! Times of submissions are drawn from `scale.csv`: measured processor time of `grade` and all its children.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::fmt::Write;
use std::path::PathBuf;

use fastrand::Rng;
use grader::class::entry::ClassEntry;
use grader::class::plan::{Plan, Planned};
use test_support::{assert_document, root};

/// Measured processor time, in seconds, by kind of program.
const MEASURED: &str = include_str!("scale.csv");

/// A cluster and what goes wrong in it. Times in seconds.
#[derive(Clone, Copy)]
struct Cluster {
    nodes: usize,
    /// Jobs that a node runs at the same time, each on one core.
    slots: usize,
    /// Time from the end of a job to the first submission of the next in its slot.
    start_up: f64,
    /// Mean time between two failures of a node.
    node_failure: f64,
    /// Time until a failed node is back.
    repair: f64,
    /// Mean running time of a job until it is killed.
    job_failure: f64,
    /// Share of slow nodes, and their factor.
    slow: (f64, f64),
}

const CALM: Cluster = Cluster {
    nodes: 100,
    slots: 16,
    start_up: 2.0,
    node_failure: f64::INFINITY,
    repair: 1800.0,
    job_failure: f64::INFINITY,
    slow: (0.0, 1.0),
};

const ROUGH: Cluster =
    Cluster { node_failure: 10.0 * 86_400.0, job_failure: 3600.0, slow: (0.05, 3.0), ..CALM };

/// A shard: the times of its submissions that have no result yet.
type Job = VecDeque<f64>;

/// Result of a simulation.
#[derive(Default)]
struct Outcome {
    makespan: f64,
    /// Core seconds of all jobs, start-up included.
    bill: f64,
    /// Core seconds of work that was done again.
    lost: f64,
    requeues: usize,
    /// Starts of jobs.
    starts: usize,
    graded: usize,
    /// Times at which submissions had their results.
    finished: Vec<f64>,
}

/// Something that happens in a slot.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    /// It can take a job.
    Free,
    /// Its job has started.
    Started,
    /// Its job has graded a submission.
    Graded,
    /// Its job is killed, alone or with the node.
    Killed,
}

fn exponential(random: &mut Rng, mean: f64) -> f64 {
    if mean.is_finite() { -mean * (1.0 - random.f64()).ln() } else { f64::INFINITY }
}

/// A node: the beginning and end of its current or next outage, and the factor of all times on it.
struct Node {
    outage: (f64, f64),
    factor: f64,
}

impl Node {
    fn new(cluster: Cluster, random: &mut Rng) -> Self {
        let factor = if random.f64() < cluster.slow.0 { cluster.slow.1 } else { 1.0 };
        let mut node = Self { outage: (0.0, 0.0), factor };
        node.advance(cluster, 0.0, random);
        node
    }

    /// Makes `outage` the one that ends after `now`.
    fn advance(&mut self, cluster: Cluster, now: f64, random: &mut Rng) {
        while self.outage.1 <= now {
            let begin = self.outage.1 + exponential(random, cluster.node_failure);
            self.outage = (begin, begin + cluster.repair);
        }
    }
}

/// Runs the shards on the cluster.
fn simulate(cluster: Cluster, shards: &[Vec<f64>], seed: u64) -> Outcome {
    let mut random = Rng::with_seed(seed);
    let mut nodes: Vec<Node> =
        (0..cluster.nodes).map(|_| Node::new(cluster, &mut random)).collect();
    let mut queue: VecDeque<Job> =
        shards.iter().map(|shard| shard.iter().copied().collect()).collect();
    let slots = cluster.nodes * cluster.slots;
    let mut running: Vec<Job> = vec![Job::new(); slots];
    let mut idle: VecDeque<usize> = VecDeque::new();
    let mut outcome = Outcome::default();
    // In microseconds: whole numbers have a total order.
    let mut events: BinaryHeap<Reverse<(u64, usize, Event)>> =
        (0..slots).map(|slot| Reverse((0, slot, Event::Free))).collect();
    while let Some(Reverse((time, slot, event))) = events.pop() {
        let now = time as f64 / 1e6;
        let node = &mut nodes[slot / cluster.slots];
        node.advance(cluster, now, &mut random);
        let mut push = |time: f64, slot, event| {
            events.push(Reverse(((time * 1e6).ceil() as u64, slot, event)));
        };
        let job = &mut running[slot];
        if event == Event::Graded {
            job.pop_front();
            outcome.graded += 1;
            outcome.finished.push(now);
            outcome.makespan = now;
        }
        match (event, job.front()) {
            (Event::Free, _) if node.outage.0 <= now => push(node.outage.1, slot, Event::Free),
            (Event::Free, _) => idle.push_back(slot),
            (Event::Killed, _) => {
                outcome.requeues += 1;
                queue.push_back(std::mem::take(job));
                push(now, slot, Event::Free);
            }
            (Event::Started | Event::Graded, None) => push(now, slot, Event::Free),
            (Event::Started | Event::Graded, Some(seconds)) => {
                let seconds = seconds * node.factor;
                let outage = (node.outage.0 - now).max(0.0);
                let end = exponential(&mut random, cluster.job_failure).min(outage);
                outcome.bill += end.min(seconds);
                if end < seconds {
                    outcome.lost += end;
                    push(now + end, slot, Event::Killed);
                } else {
                    push(now + seconds, slot, Event::Graded);
                }
            }
        }
        while let (Some(slot), false) = (idle.front().copied(), queue.is_empty()) {
            idle.pop_front();
            running[slot] = queue.pop_front().unwrap_or_default();
            outcome.bill += cluster.start_up;
            outcome.starts += 1;
            let time = ((now + cluster.start_up) * 1e6).ceil() as u64;
            events.push(Reverse((time, slot, Event::Started)));
        }
    }
    outcome
}

/// Times of a class, drawn from the measured ones.
fn class(count: usize, random: &mut Rng) -> Vec<f64> {
    let lines = MEASURED.lines().skip(1).filter(|line| !line.is_empty());
    let seconds: Vec<f64> =
        lines.map(|line| line.rsplit(',').next().unwrap().parse().unwrap()).collect();
    (0..count).map(|_| seconds[random.usize(..seconds.len())]).collect()
}

/// The shards of the grader's own division, with known times; none is equal to another.
fn divide(times: &[f64], shards: usize) -> Vec<Vec<f64>> {
    let planned = |number: usize| {
        let (name, report) = (String::new(), String::new());
        Planned::new(ClassEntry { name, path: PathBuf::new(), report }, format!("{number:08}"))
    };
    let submissions = (0..times.len()).map(planned).collect();
    let mut plan = Plan::new((PathBuf::new(), Vec::new()), String::new(), submissions, Vec::new());
    let places: Vec<usize> = (0..times.len()).collect();
    let known: BTreeMap<usize, f64> = times.iter().copied().enumerate().collect();
    plan.divide(&places, &known, shards);
    plan.shards.iter().map(|shard| shard.iter().map(|place| times[*place]).collect()).collect()
}

/// No order of the submissions ends sooner.
fn lower_bound(cluster: Cluster, times: &[f64]) -> f64 {
    let longest = times.iter().copied().fold(0.0, f64::max);
    longest.max(times.iter().sum::<f64>() / (cluster.nodes * cluster.slots) as f64)
}

#[test]
fn every_submission_is_graded_once_despite_failures() {
    let times = class(3000, &mut Rng::with_seed(1));
    let cluster = Cluster { nodes: 5, slots: 4, ..ROUGH };
    let harsh = Cluster { node_failure: 600.0, job_failure: 60.0, ..cluster };
    for (cluster, shards) in
        [(Cluster { nodes: 5, slots: 4, ..CALM }, 60), (cluster, 60), (harsh, 300)]
    {
        let outcome = simulate(cluster, &divide(&times, shards), 7);
        assert_eq!(outcome.graded, times.len());
        assert!(outcome.makespan >= lower_bound(cluster, &times));
        let work: f64 = times.iter().sum();
        assert!(outcome.bill >= work + outcome.lost);
        assert_eq!(outcome.requeues > 0, cluster.job_failure.is_finite());
    }
}

/// The line chart of graded submissions by time, as SVG.
fn chart(curves: &[(&str, &Outcome)]) -> String {
    let (width, height, left, top) = (560.0, 280.0, 70.0, 20.0);
    let end = curves.iter().map(|(_, outcome)| outcome.makespan).fold(0.0, f64::max);
    let most = curves.iter().map(|(_, outcome)| outcome.graded).max().unwrap_or(1);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 660 350\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"660\" height=\"350\" fill=\"white\"/>\n<path d=\"M{left} {top}V{0}H{1}\" fill=\"none\" stroke=\"black\"/>\n",
        top + height,
        left + width
    );
    for part in 0..=4 {
        let share = f64::from(part) / 4.0;
        let (x, y) = (left + share * width, top + height * (1.0 - share));
        let _ = writeln!(
            svg,
            "<text x=\"{x:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{:.1}</text>\n\
             <text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">{:.0}</text>",
            top + height + 16.0,
            share * end / 60.0,
            left - 6.0,
            y + 4.0,
            share * most as f64
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{:.0}\" y=\"340\" text-anchor=\"middle\">minutes</text>\n\
         <text x=\"16\" y=\"{1:.0}\" text-anchor=\"middle\" transform=\"rotate(-90 16 {1:.0})\">submissions graded</text>",
        left + width / 2.0,
        top + height / 2.0
    );
    let colours = ["#1b6ca8", "#c1440e", "#4b8b3b", "#7a5195"];
    for (number, ((name, outcome), colour)) in curves.iter().zip(colours).enumerate() {
        let points = (0..=100).map(|part| {
            let place = (outcome.graded - 1) * part / 100;
            let x = left + outcome.finished[place] / end * width;
            format!("{x:.1},{:.1}", top + height * (1.0 - (place + 1) as f64 / most as f64))
        });
        let points: Vec<String> = points.collect();
        let y = top + 150.0 + 20.0 * number as f64;
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>\n\
             <text x=\"{:.0}\" y=\"{y:.0}\" fill=\"{colour}\">{name}</text>",
            points.join(" "),
            left + 330.0
        );
    }
    svg + "</svg>\n"
}

#[test]
fn the_page_shows_the_simulation() {
    const COUNT: usize = 100_000;
    let times = class(COUNT, &mut Rng::with_seed(18));
    let work: f64 = times.iter().sum();
    let mut text = format!(
        "{COUNT} submissions take {:.0} core hours; mean {:.2} s, longest {:.1} s. The cluster has {} nodes, each with {} jobs of \
         one core. Seed 18.\n\n\
         | shards | cluster | makespan, min | lower bound, min | core hours | start-up, h | lost, h | requeues | results a \
         second |\n| ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n",
        work / 3600.0,
        work / COUNT as f64,
        times.iter().copied().fold(0.0, f64::max),
        CALM.nodes,
        CALM.slots,
    );
    let mut curves = Vec::new();
    for shards in [1000, 1600, 5000, 20_000] {
        let divided = divide(&times, shards);
        for (cluster, kind) in [(CALM, "calm"), (ROUGH, "rough")] {
            let outcome = simulate(cluster, &divided, 18);
            assert_eq!(outcome.graded, COUNT);
            let _ = writeln!(
                text,
                "| {shards} | {kind} | {:.1} | {:.1} | {:.1} | {:.1} | {:.2} | {} | {:.0} |",
                outcome.makespan / 60.0,
                lower_bound(cluster, &times) / 60.0,
                outcome.bill / 3600.0,
                cluster.start_up * outcome.starts as f64 / 3600.0,
                outcome.lost / 3600.0,
                outcome.requeues,
                COUNT as f64 / outcome.makespan,
            );
            if [1000, 5000].contains(&shards) {
                curves.push((format!("{kind}, {shards} shards"), outcome));
            }
        }
    }
    let command = "cargo test --release -p studies scale";
    let curves: Vec<(&str, &Outcome)> =
        curves.iter().map(|(name, outcome)| (name.as_str(), outcome)).collect();
    assert_document("pictures/scale.svg", &chart(&curves), command);
    let page = std::fs::read_to_string(root().join("docs/scale.md")).unwrap();
    let page = fill(&page, "measured times", &measured());
    assert_document("scale.md", &fill(&page, "simulation", &text), command);
}

/// The page with the part between the two comments of this name replaced.
fn fill(page: &str, name: &str, text: &str) -> String {
    let (before, rest) = page.split_once(&format!("<!-- {name} -->")).unwrap();
    let end = format!("<!-- end of the {name} -->");
    let (_, after) = rest.split_once(&end).unwrap();
    format!("{before}<!-- {name} -->\n\n{text}\n{end}{after}")
}

/// The table of the measured times.
fn measured() -> String {
    let mut kinds: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for line in MEASURED.lines().skip(1) {
        let (kind, seconds) = line.split_once(',').unwrap();
        kinds.entry(kind).or_default().push(seconds.parse().unwrap());
    }
    let mut text =
        "| program | number | least | median | most |\n| --- | ---: | ---: | ---: | ---: |\n"
            .to_owned();
    for (kind, mut seconds) in kinds {
        seconds.sort_by(f64::total_cmp);
        let [least, median, most] =
            [0, seconds.len() / 2, seconds.len() - 1].map(|place| seconds[place]);
        let _ =
            writeln!(text, "| {kind} | {} | {least:.1} | {median:.1} | {most:.1} |", seconds.len());
    }
    text
}
