//! The tables: to the terminal line by line as they are measured, and as Markdown at the end.

use std::fmt::Write as _;
use std::io::{self, Write};

use crate::limits::Limits;
use crate::measure::{self, Cell, FACTORISING, Factors, growth, least};
use crate::method::{Body, METHODS, Method, Peer};
use crate::ours::Taken;
use crate::theirs::{Factorisation, Peers};

/// Measurements so far.
pub(crate) struct Tables<'a> {
    output: &'a mut dyn Write,
    markdown: String,
}

const HEADER: [&str; 12] = [
    "n",
    "springs",
    "steps",
    "ours",
    "limit",
    "reached",
    "theirs",
    "ratio",
    "spread",
    "target",
    "result",
    "differ by",
];
const WIDTHS: [usize; 12] = [4, 7, 7, 9, 9, 7, 9, 6, 11, 6, 14, 9];

const FACTOR_HEADER: [&str; 16] = [
    "n",
    "rows",
    "ours, Gflop",
    "ms",
    "Gflop/s",
    "of peak",
    "CHOLMOD, Gflop",
    "ms",
    "Gflop/s",
    "of peak",
    "ratio",
    "PARDISO, Gflop",
    "ms",
    "Gflop/s",
    "of peak",
    "ratio",
];
const FACTOR_WIDTHS: [usize; 16] = [4, 7, 11, 7, 7, 7, 14, 7, 7, 7, 6, 14, 7, 7, 7, 6];

/// Segments a side of the nets whose factorisation is timed.
const FACTORS: [usize; 4] = [64, 128, 256, 512];

const LIMITS_HEADER: [&str; 2] = ["one core", "limit"];
const LIMITS_WIDTHS: [usize; 2] = [44, 12];

const GROWTH_HEADER: [&str; 7] =
    ["n", "particles", "first step, s", "a step, s", "exponent", "MB", "exponent"];
const GROWTH_WIDTHS: [usize; 7] = [4, 9, 13, 9, 8, 6, 8];

/// Segments a side of the nets whose growth is shown; the last has 1,024 by 1,024 particles, the most that a scene may have.
const GROWTH: [usize; 5] = [64, 128, 256, 512, 1023];

/// Seconds that a net may be expected to take.
const PATIENCE: f64 = 300.0;

impl<'a> Tables<'a> {
    /// No tables yet.
    pub(crate) fn new(output: &'a mut dyn Write) -> Self {
        Self { output, markdown: String::new() }
    }

    /// The tables as Markdown.
    pub(crate) fn markdown(&self) -> &str {
        &self.markdown
    }

    /// The table of what one core can do.
    pub(crate) fn limits(&mut self, limits: &Limits) -> io::Result<()> {
        self.title("Limits of this machine")?;
        self.header(&LIMITS_HEADER, &LIMITS_WIDTHS)?;
        let Limits { root, division, peak, bandwidths } = limits;
        let mut rows = vec![
            ("square root, in vectors".into(), format!("{} ns", significant(*root))),
            ("division, in vectors".into(), format!("{} ns", significant(*division))),
            ("fused multiplications and additions".into(), format!("{} a ns", significant(*peak))),
        ];
        rows.extend(bandwidths.iter().map(|(bytes, rate)| {
            (
                format!("reading {} KiB again and again", bytes >> 10),
                format!("{} GB/s", significant(*rate)),
            )
        }));
        rows.into_iter().try_for_each(|(what, limit)| self.row(&[what, limit], &LIMITS_WIDTHS))
    }

    /// The head of a method's table.
    pub(crate) fn start(&mut self, method: &Method) -> io::Result<()> {
        let Method { title, time_step, peer, body, .. } = method;
        let (unit, beside) = (method.unit_name(), peer.describe());
        let of_step = match peer {
            Peer::ScikitFem => String::new(),
            _ => format!(" (time step {time_step} s)"),
        };
        self.title(&format!("{title}, {unit}, beside {beside}{of_step}"))?;
        let mut header = HEADER;
        header[1] = body.elements_name();
        self.header(&header, &WIDTHS)
    }

    /// A line of it.
    pub(crate) fn cell(&mut self, method: &Method, cell: &Cell, limits: &Limits) -> io::Result<()> {
        let unknown = || String::from("-");
        let time = |times: &Result<Vec<f64>, String>| {
            let time = |times: &Vec<f64>| method.unit.of(least(times), cell.elements);
            times.as_ref().map_or_else(|_| unknown(), |times| significant(time(times)))
        };
        let ratio = cell.ratio();
        let verdict = match ratio {
            Some((ratio, _)) if ratio >= cell.target => "met".into(),
            Some((ratio, _)) => format!("missed by {}", significant(cell.target - ratio)),
            None => unknown(),
        };
        let spread = |(_, [low, high]): (f64, [f64; 2])| {
            format!("{}..{}", significant(low), significant(high))
        };
        let limit = cell.work.map(|work| limits.time(&work)).filter(|limit| *limit > 0.0);
        let reached = limit.zip(cell.ours.as_ref().ok());
        let row = [
            cell.segments.to_string(),
            cell.elements.to_string(),
            cell.steps.to_string(),
            time(&cell.ours),
            time(&limit.map(|limit| vec![limit]).ok_or_else(String::new)),
            reached.map_or_else(unknown, |(limit, ours)| {
                format!("{:.0} %", 100.0 * limit / least(ours))
            }),
            time(&cell.theirs),
            ratio.map_or_else(unknown, |(ratio, _)| significant(ratio)),
            ratio.map_or_else(unknown, spread),
            cell.target.to_string(),
            verdict,
            cell.difference.as_ref().map_or_else(|_| unknown(), |value| format!("{value:.0e}")),
        ];
        self.row(&row, &WIDTHS)
    }

    /// Remarks below a method's table.
    pub(crate) fn end(&mut self, cells: &[Cell]) -> io::Result<()> {
        if let [.., small, large] = cells {
            let [ours, theirs] = growth(cells).map(|exponent| {
                exponent.map_or_else(|| "-".into(), |exponent| format!("{exponent:.2}"))
            });
            let (small, large) = (small.segments, large.segments);
            self.note(&format!(
                "growth exponent, {small} to {large}: ours {ours}, theirs {theirs}"
            ))?;
        }
        for Cell { segments, steps, refused, .. } in cells.iter().filter(|cell| cell.refused > 0) {
            self.note(&format!(
                "{segments}: {refused} of {steps} matrices are indefinite, and were factorised by theirs as LDLᵀ"
            ))?;
        }
        let mut lines: Vec<_> = cells.iter().flat_map(reasons).collect();
        lines.sort();
        lines.dedup();
        lines.iter().try_for_each(|reason| self.note(reason))
    }

    /// The table of factorisations alone, ours and those of the peers.
    pub(crate) fn factors(
        &mut self,
        limits: &Limits,
        repeats: u64,
        peers: &Peers,
    ) -> io::Result<()> {
        let cores = rayon::current_num_threads();
        self.title(&format!(
            "Factorisation of the matrix of linearized implicit Euler, {cores} threads"
        ))?;
        self.header(&FACTOR_HEADER, &FACTOR_WIDTHS)?;
        let side = |side: &Result<Factorisation, String>| match side {
            // A Gflop/s is an operation a ns.
            Ok(Factorisation { time, operations }) => {
                let (rate, peak) = (operations / time, limits.peak * cores as f64);
                let figures = [operations * 1e-9, time * 1e-6, rate].map(significant).to_vec();
                [figures, vec![format!("{:.0} %", 100.0 * rate / peak)]].concat()
            }
            Err(_) => vec!["-".into(); 4],
        };
        let mut notes = Vec::new();
        for segments in FACTORS {
            let Factors { segments, rows, ours, theirs } =
                measure::factors(segments, repeats, peers);
            let ratio = |theirs: &Result<Factorisation, String>| match (&ours, theirs) {
                (Ok(ours), Ok(theirs)) => significant(theirs.time / ours.time),
                _ => "-".into(),
            };
            let mut row = vec![segments.to_string(), rows.to_string()];
            row.extend(side(&ours));
            for theirs in &theirs {
                row.extend(side(theirs));
                row.push(ratio(theirs));
            }
            self.row(&row, &FACTOR_WIDTHS)?;
            let peers = FACTORISING.map(Peer::describe).into_iter().zip(theirs);
            let sides = [("ours", ours)].into_iter().chain(peers);
            let reasons = sides.filter_map(|(who, side)| Some((who, side.err()?)));
            notes.extend(reasons.map(|(who, reason)| format!("{who} not measured: {reason}")));
        }
        notes.sort();
        notes.dedup();
        notes.iter().try_for_each(|note| self.note(note))
    }

    /// The tables of time and memory up to a million particles; `taken` measures a net.
    pub(crate) fn growth(
        &mut self,
        taken: &dyn Fn(&Method, usize) -> Result<Taken, String>,
    ) -> io::Result<()> {
        for method in
            METHODS.iter().filter(|method| matches!(method.peer, Peer::Eigen(_) | Peer::Python))
        {
            self.title(&format!("{}, ours, by size", method.title))?;
            self.header(&GROWTH_HEADER, &GROWTH_WIDTHS)?;
            let mut before: Option<(usize, Taken)> = None;
            for segments in GROWTH {
                // With four times as many springs.
                let expected = before.map_or(0.0, |(_, Taken { first, later, .. })| {
                    8.0 * (first + later * (Taken::STEPS - 1) as f64)
                });
                if expected > PATIENCE {
                    let minutes = expected / 60.0;
                    let reason = format!("{segments} not measured: up to {minutes:.0} minutes");
                    self.note(&reason)?;
                    break;
                }
                let now = match taken(method, segments) {
                    Ok(now) => now,
                    Err(reason) => {
                        self.note(&format!("{segments} not measured: {reason}"))?;
                        break;
                    }
                };
                let particles = (segments + 1) * (segments + 1);
                let exponents = before.map(|(fewer, before)| {
                    let [many, few] = [segments, fewer].map(|n| Body::Net.elements(n) as f64);
                    let springs = (many / few).ln();
                    [now.later / before.later, now.bytes as f64 / before.bytes as f64]
                        .map(|factor| format!("{:.2}", factor.ln() / springs))
                });
                let [of_time, of_memory] =
                    exponents.unwrap_or_else(|| [(); 2].map(|()| "-".into()));
                let row = [
                    segments.to_string(),
                    particles.to_string(),
                    significant(now.first),
                    significant(now.later),
                    of_time,
                    format!("{:.0}", now.bytes as f64 * 1e-6),
                    of_memory,
                ];
                self.row(&row, &GROWTH_WIDTHS)?;
                before = Some((segments, now));
            }
        }
        Ok(())
    }

    fn title(&mut self, title: &str) -> io::Result<()> {
        let _ = write!(self.markdown, "\n## {title}\n\n");
        writeln!(self.output, "\n{title}")
    }

    fn header(&mut self, names: &[&str], widths: &[usize]) -> io::Result<()> {
        let names: Vec<_> = names.iter().map(|name| (*name).to_owned()).collect();
        self.row(&names, widths)?;
        let _ = writeln!(self.markdown, "|{}", " ---: |".repeat(names.len()));
        Ok(())
    }

    fn row(&mut self, row: &[String], widths: &[usize]) -> io::Result<()> {
        let _ = writeln!(self.markdown, "| {} |", row.join(" | "));
        let padded = row.iter().zip(widths).map(|(cell, width)| format!("{cell:>width$}"));
        writeln!(self.output, "{}", padded.collect::<Vec<_>>().join(" "))
    }

    fn note(&mut self, note: &str) -> io::Result<()> {
        let _ = writeln!(self.markdown, "\n{note}");
        writeln!(self.output, "     {note}")
    }
}

/// Why a cell lacks what it lacks.
fn reasons(cell: &Cell) -> Vec<String> {
    let Cell { ours, theirs, difference, .. } = cell;
    match (ours, theirs, difference) {
        (Ok(_), Ok(_), Ok(_)) => vec![],
        (Ok(_), Ok(_), Err(reason)) => vec![format!("positions not compared: {reason}")],
        _ => {
            let sides = [("ours", ours), ("theirs", theirs)];
            let failed = sides.iter().filter_map(|(who, times)| Some((who, times.as_ref().err()?)));
            failed.map(|(who, reason)| format!("{who} not measured: {reason}")).collect()
        }
    }
}

/// Three digits, without an exponent.
fn significant(value: f64) -> String {
    let decimals = (2.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$}")
}
