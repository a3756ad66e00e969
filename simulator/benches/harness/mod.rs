//! Times closures and prints the least and the median of several samples.
//!
//! `cargo bench --bench NAME -- PART` runs the benches whose names contain PART. Started by other means than `cargo
//! bench`, each runs once and is not timed.

use std::hint::black_box;
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// The most inputs that are made before they are timed.
const INPUTS: u64 = 1024;

/// How benches are timed.
pub(crate) struct Harness {
    /// Of all names, those that contain this.
    filter: String,
    timed: bool,
    /// Number of samples, after one that is thrown away.
    samples: usize,
    /// A sample repeats the work until it has taken this long.
    length: Duration,
}

impl Harness {
    /// Reads the filter from the command line.
    pub(crate) fn new(samples: usize, length: Duration) -> Self {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let filter = arguments.iter().find(|argument| !argument.starts_with('-')).cloned();
        let timed = arguments.iter().any(|argument| argument == "--bench");
        Self { filter: filter.unwrap_or_default(), timed, samples, length }
    }

    /// Times `work`, which handles this many elements.
    pub(crate) fn run<T>(&self, name: &str, elements: u64, mut work: impl FnMut() -> T) {
        self.run_on(name, elements, || (), |()| work());
    }

    /// Times `work` on inputs that are made beforehand.
    pub(crate) fn run_on<I, T>(
        &self,
        name: &str,
        elements: u64,
        mut input: impl FnMut() -> I,
        mut work: impl FnMut(&mut I) -> T,
    ) {
        if !name.contains(&self.filter) {
            return;
        }
        let mut out = io::stdout().lock();
        if !self.timed {
            black_box(work(&mut input()));
            let _ = writeln!(out, "{name}: ran once");
            return;
        }
        let mut batch = 1;
        let mut sample = || {
            let (mut time, mut count) = (Duration::ZERO, 0);
            while time < self.length {
                let mut inputs: Vec<I> = (0..batch).map(|_| input()).collect();
                // Dropping what comes out is not timed.
                let mut results = Vec::with_capacity(inputs.len());
                let start = Instant::now();
                for each in &mut inputs {
                    results.push(black_box(work(black_box(each))));
                }
                let taken = start.elapsed();
                (time, count) = (time + taken, count + batch);
                if taken < self.length / 2 {
                    batch = (2 * batch).min(INPUTS);
                }
            }
            time.as_secs_f64() / count as f64
        };
        sample();
        let mut times: Vec<f64> = (0..self.samples).map(|_| sample()).collect();
        times.sort_by(f64::total_cmp);
        let (least, median) = (times[0], times[times.len() / 2]);
        let [shown, middle, share] = [least, median, least / elements as f64].map(time);
        let _ = writeln!(out, "{name:48} least {shown}  median {middle}  an element {share}");
    }
}

/// A time of some seconds, with its unit.
fn time(seconds: f64) -> String {
    let units = [(1.0, "s "), (1e-3, "ms"), (1e-6, "µs")];
    let unit = units.into_iter().find(|(unit, _)| seconds >= *unit);
    let (unit, name) = unit.unwrap_or((1e-9, "ns"));
    format!("{:8.3} {name}", seconds / unit)
}
