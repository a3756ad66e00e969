//! A cell of the table: both sides, in turn, on one body.

use crate::limits::Work;
use crate::method::{Method, Peer};
use crate::ours::{Factor, Ours};
use crate::theirs::{Factorisation, Peers};

/// Both sides on one body. Times are in ns a step, one a repeat.
pub(crate) struct Cell {
    /// Segments a side.
    pub(crate) segments: usize,
    /// Springs, or triangles.
    pub(crate) elements: usize,
    /// Steps a measurement.
    pub(crate) steps: u64,
    /// The ratio aimed at.
    pub(crate) target: f64,
    /// Our times, or why there are none.
    pub(crate) ours: Result<Vec<f64>, String>,
    /// Our work in a step, if it was measured.
    pub(crate) work: Option<Work>,
    /// The peer's times, or why there are none.
    pub(crate) theirs: Result<Vec<f64>, String>,
    /// Steps of a measurement whose matrix the peer could not factorise as it does the others.
    pub(crate) refused: u64,
    /// The largest difference of positions after [`CHECKED_STEPS`], or as many as are measured; or why
    /// it is not known.
    pub(crate) difference: Result<f64, String>,
}

/// Few, so that rounding has no time to grow: the bodies are chaotic.
const CHECKED_STEPS: u64 = 20;

/// Measures a cell. The check of the positions comes first, and warms both sides up.
pub(crate) fn cell(
    method: &Method,
    segments: usize,
    target: f64,
    repeats: u64,
    peers: &Peers,
) -> Cell {
    let elements = method.body.elements(segments);
    let steps = method.steps(elements);
    let checked = steps.min(CHECKED_STEPS);
    let scene = Ours::new(method, segments as u64, steps);
    let difference = scene.as_ref().map_err(String::clone).and_then(|ours| {
        let positions = ours.positions(checked)?;
        peers.difference(method, segments, checked, (ours.scene(), &positions))
    });
    let (mut ours, mut theirs) = (Ok(Vec::new()), Ok(Vec::new()));
    let mut work = None;
    let mut refused = 0;
    for _ in 0..repeats {
        add(&mut ours, || {
            let (time, of_step) = scene.as_ref().map_err(String::clone)?.time()?;
            work = of_step;
            Ok(time)
        });
        add(&mut theirs, || {
            let run = peers.run(method, segments, steps)?;
            refused = run.refused;
            Ok(run.time)
        });
    }
    Cell { segments, elements, steps, target, ours, work, theirs, refused, difference }
}

/// Factorisations of the matrix of one net, ours and those of the peers.
pub(crate) struct Factors {
    /// Segments a side.
    pub(crate) segments: usize,
    /// Rows of the matrix.
    pub(crate) rows: usize,
    /// Ours, with the least of the times, or why it was not measured.
    pub(crate) ours: Result<Factorisation, String>,
    /// The same of each peer.
    pub(crate) theirs: [Result<Factorisation, String>; 2],
}

/// The peers whose factorisations are timed.
pub(crate) const FACTORISING: [Peer; 2] = [Peer::Cholmod("lie"), Peer::Pardiso];

/// Measures the factorisations, in turn.
pub(crate) fn factors(segments: usize, repeats: u64, peers: &Peers) -> Factors {
    let mut factor = Factor::new(segments as u64);
    let mut ours = Ok(Vec::new());
    let mut theirs = FACTORISING.map(|peer| (peer, Ok(Vec::new()), 0.0));
    for _ in 0..repeats {
        add(&mut ours, || factor.as_mut().map_err(|reason| reason.clone())?.time());
        for (peer, times, operations) in &mut theirs {
            add(times, || {
                let once = peers.factorisation(*peer, segments)?;
                *operations = once.operations;
                Ok(once.time)
            });
        }
    }
    let of_ours = factor.map_or(0.0, |factor| factor.operations);
    let best = |times: Result<Vec<f64>, String>, operations: f64| {
        times.map(|times| Factorisation { time: least(&times), operations })
    };
    Factors {
        segments,
        rows: 2 * (segments + 1) * (segments + 1),
        ours: best(ours, of_ours),
        theirs: theirs.map(|(_, times, operations)| best(times, operations)),
    }
}

/// One more time, unless an earlier one failed.
fn add(times: &mut Result<Vec<f64>, String>, time: impl FnOnce() -> Result<f64, String>) {
    if let Ok(list) = times {
        match time() {
            Ok(time) => list.push(time),
            Err(reason) => *times = Err(reason),
        }
    }
}

impl Cell {
    /// Theirs over ours, of the least times; and the least and largest of the repeats.
    pub(crate) fn ratio(&self) -> Option<(f64, [f64; 2])> {
        let (ours, theirs) = (self.ours.as_ref().ok()?, self.theirs.as_ref().ok()?);
        let ratios = || theirs.iter().zip(ours).map(|(theirs, ours)| theirs / ours);
        let spread = [ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max)];
        Some((least(theirs) / least(ours), spread))
    }
}

/// The least time.
pub(crate) fn least(times: &[f64]) -> f64 {
    times.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Slope of log time against log elements between the two largest nets, ours and theirs.
pub(crate) fn growth(cells: &[Cell]) -> [Option<f64>; 2] {
    let side = |times: fn(&Cell) -> &Result<Vec<f64>, String>| {
        let [.., small, large] = cells else { return None };
        let time = |cell| Some(least(times(cell).as_ref().ok()?));
        let elements = large.elements as f64 / small.elements as f64;
        Some((time(large)? / time(small)?).ln() / elements.ln())
    };
    [side(|cell| &cell.ours), side(|cell| &cell.theirs)]
}
