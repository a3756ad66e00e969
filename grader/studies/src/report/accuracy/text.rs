//! Text report of errors and costs.

use std::io::{self, Write};

use anstyle::{AnsiColor, Style};

use super::{short, time};
use crate::accuracy::cheapest::Offer;
use crate::accuracy::confirm::{Agreement, Confirmation};
use crate::accuracy::order::{self, Expected, Fit};
use crate::accuracy::reference::Source;
use crate::accuracy::{Curve, Errors, Order, Point, Quantity, RunOutcome, SceneStudy, Study};
use report::table::{self, Cell};

const BOLD: Style = Style::new().bold();
const RED: Style = AnsiColor::Red.on_default();

/// Options of the report.
#[derive(Debug, Clone, Copy, Default)]
pub struct AccuracyTextOptions {
    /// Show every point of every curve.
    pub details: bool,
}

/// Writes the report.
///
/// # Errors
/// If writing fails.
pub fn write(out: &mut dyn Write, study: &Study, config: AccuracyTextOptions) -> io::Result<()> {
    for scene in &study.scenes {
        heading(out, scene)?;
        orders(out, scene)?;
        for foreign in [false, true] {
            levels(out, scene, foreign)?;
        }
        blow_ups(out, scene)?;
        if config.details {
            points(out, scene)?;
        }
        writeln!(out)?;
    }
    summary(out, study)
}

/// Writes what all scenes together say about the order of each method.
fn summary(out: &mut dyn Write, study: &Study) -> io::Result<()> {
    let whose = study.submission.as_deref().unwrap_or("built-in simulator");
    writeln!(out, "{BOLD}Summary for {whose}{BOLD:#}")?;
    let confirmations = study.confirmations();
    if !confirmations.is_empty() {
        let names = ["method", "order", "slopes", "confirmed by"];
        let mut rows = vec![Vec::from(names.map(Cell::left))];
        rows.extend(confirmations.iter().map(confirmation_row));
        table::write(out, &rows)?;
    }
    let agreement = study.agreement();
    let Agreement { agree, exact, differ, unknown } = agreement;
    writeln!(
        out,
        "  {} orders: {agree} within {} of theory, {exact} exact up to rounding, {differ} not as theory says, {unknown} \
         unknown",
        agreement.judged(),
        order::TOLERANCE,
    )?;
    if unknown > 0 {
        writeln!(out, "  unknown: no {} time steps in a row have a regular slope", order::FEWEST)?;
    }
    for Confirmation { label, order, .. } in study.unconfirmed() {
        let order = short(order);
        writeln!(out, "  {RED}no scene measured here confirms order {order} of {label}{RED:#}")?;
    }
    if study.submission.is_some() {
        writeln!(
            out,
            "  submission: errors from traces alone; wall times of whole processes, not comparable with the built-in simulator's"
        )?;
    }
    Ok(())
}

fn confirmation_row(confirmation: &Confirmation) -> Vec<Cell> {
    let Confirmation { label, order, scenes, confirmed, .. } = confirmation;
    let slopes = match confirmation.range() {
        Some([least, largest]) => format!("{least:.3} … {largest:.3}"),
        None => "-".to_owned(),
    };
    let count = Cell::left(format!("{} of {scenes} scenes", confirmed.len()));
    vec![
        Cell::left(label.clone()),
        Cell::right(short(*order)),
        Cell::left(slopes),
        if confirmed.is_empty() { count.styled(RED) } else { count },
    ]
}

fn heading(out: &mut dyn Write, scene: &SceneStudy) -> io::Result<()> {
    let (target, reference) = (&scene.target, &scene.reference);
    let n = target.scene.particles.len();
    let particles = if n == 1 { "1 particle".to_owned() } else { format!("{n} particles") };
    let (name, title) = (&target.name, &target.title);
    let duration = short(reference.duration);
    writeln!(out, "{BOLD}{name}{BOLD:#}  {title}; {particles}, {duration} s")?;
    let source = match reference.source {
        Source::Closed => "closed form",
        Source::Adaptive => "order 8 (DOP853), to two tolerances",
    };
    let Errors { position, velocity, energy } = reference.floor;
    writeln!(
        out,
        "  reference: {source}; error bar {position:.0e} m, {velocity:.0e} m/s, {energy:.0e} J"
    )
}

/// Writes the orders of every curve.
fn orders(out: &mut dyn Write, scene: &SceneStudy) -> io::Result<()> {
    writeln!(out, "  order p, error ~ dt^p")?;
    let mut rows = vec![
        ["method", "position", "velocity", "energy", "theory", "window of dt"]
            .map(Cell::left)
            .into(),
    ];
    let mut reasons = Vec::new();
    for curve in &scene.curves {
        let orders = scene.orders(curve);
        let mut row = vec![Cell::left(curve.label())];
        for order in &orders {
            row.push(slope(order));
            if let Some(reason) = order.reason
                && !reasons.contains(&(order.quantity, reason))
            {
                reasons.push((order.quantity, reason));
            }
        }
        row.push(Cell::left(theory(&orders, curve)));
        row.push(Cell::left(match orders[0].fit {
            Fit::Slope { window: (coarse, fine), .. } => {
                format!("{} … {}", short(coarse), short(fine))
            }
            _ => "-".to_owned(),
        }));
        rows.push(row);
    }
    table::write(out, &rows)?;
    for (quantity, reason) in reasons {
        writeln!(out, "    {}: {reason}", quantity.name())?;
    }
    Ok(())
}

/// A slope, marked if it differs from theory.
fn slope(order: &Order) -> Cell {
    let text = match order.fit {
        Fit::Slope { slope, .. } => format!("{slope:.3}"),
        Fit::Exact => "exact".to_owned(),
        Fit::None => "none".to_owned(),
    };
    match order.agrees() {
        Some(false) => Cell::left(format!("{text} !")).styled(RED),
        _ => Cell::left(text),
    }
}

fn theory(orders: &[Order; 3], curve: &Curve) -> String {
    let words = |expected: Expected| match expected {
        Expected::Order(order) => short(order),
        Expected::Exact => "exact".to_owned(),
    };
    let expected: Vec<String> =
        orders.iter().filter_map(|order| order.expected).map(words).collect();
    match expected.as_slice() {
        [] if curve.method.order.is_none() => "bound by its tolerance".to_owned(),
        [] => "not judged".to_owned(),
        [first, rest @ ..] if rest.iter().all(|other| other == first) => first.clone(),
        several => several.join(", "),
    }
}

/// Writes the cheapest methods for each error.
fn levels(out: &mut dyn Write, scene: &SceneStudy, foreign: bool) -> io::Result<()> {
    let levels = scene.levels(foreign);
    if levels.is_empty() {
        return Ok(());
    }
    let whose = if foreign { ", theirs (wall time of the process)" } else { "" };
    writeln!(out, "  least time for a position error{whose}")?;
    let mut rows =
        vec![["error", "method", "dt", "time", "evaluations", "next"].map(Cell::left).into()];
    for level in &levels {
        let [best, rest @ ..] = level.offers.as_slice() else { continue };
        let name = |offer: &Offer| scene.curves[offer.curve].method.label();
        let evaluations = best.force_evaluations.map_or("-".to_owned(), |n| format!("{n:.0}"));
        let next = match rest.first() {
            Some(next) => format!("{}, {:.2} times as long", name(next), next.time / best.time),
            None => "no other method reaches it".to_owned(),
        };
        rows.push(vec![
            Cell::left(format!("{:.0e} m", level.error)),
            Cell::left(name(best)),
            Cell::left(short(best.time_step)),
            Cell::right(time(best.time)),
            Cell::right(evaluations),
            Cell::left(next),
        ]);
    }
    table::write(out, &rows)
}

/// Writes the runs that blew up or failed, one line per curve and cause.
fn blow_ups(out: &mut dyn Write, scene: &SceneStudy) -> io::Result<()> {
    let mut first = true;
    for curve in &scene.curves {
        let mut causes: Vec<(String, Vec<String>)> = Vec::new();
        for point in &curve.points {
            let cause = match &point.outcome {
                RunOutcome::Finished { .. } => continue,
                RunOutcome::BlownUp { .. } => "blew up".to_owned(),
                RunOutcome::Failed { step: 0, reason, .. } => reason.clone(),
                RunOutcome::Failed { reason, .. } => {
                    reason.lines().next().unwrap_or_default().to_owned()
                }
            };
            let step = short(point.time_step);
            match causes.iter_mut().find(|(known, _)| is_alike(known, &cause)) {
                Some((_, steps)) => steps.push(step),
                None => causes.push((cause, vec![step])),
            }
        }
        for (cause, steps) in causes {
            if std::mem::take(&mut first) {
                writeln!(out, "  no solution")?;
            }
            writeln!(out, "    {RED}{}{RED:#} at dt {}: {cause}", curve.label(), steps.join(", "))?;
        }
    }
    Ok(())
}

/// Whether two causes differ only in numbers.
fn is_alike(a: &str, b: &str) -> bool {
    let words = |text: &str| -> String { text.chars().filter(|c| c.is_alphabetic()).collect() };
    words(a) == words(b)
}

/// Writes every point.
fn points(out: &mut dyn Write, scene: &SceneStudy) -> io::Result<()> {
    writeln!(out, "  largest errors and cost")?;
    let names = [
        "method",
        "dt",
        "steps",
        "position",
        "velocity",
        "energy",
        "time",
        "median",
        "largest",
        "forces",
        "factorised",
        "iterations",
    ];
    let mut rows = vec![Vec::from(names.map(Cell::left))];
    for curve in &scene.curves {
        for point in &curve.points {
            rows.push(point_row(scene, curve, point));
        }
    }
    table::write(out, &rows)
}

fn point_row(scene: &SceneStudy, curve: &Curve, point: &Point) -> Vec<Cell> {
    let mut row = vec![
        Cell::left(curve.label()),
        Cell::left(short(point.time_step)),
        Cell::right(point.steps.to_string()),
    ];
    let floor = scene.reference.floor;
    let told = |errors: Errors| {
        Quantity::ALL.map(|quantity| match errors.of(quantity) {
            error if error <= floor.of(quantity) => Cell::right("at the floor"),
            error => Cell::right(format!("{error:.2e}")),
        })
    };
    match &point.outcome {
        RunOutcome::Finished { largest, .. } => row.extend(told(*largest)),
        RunOutcome::BlownUp { .. } => {
            row.extend(["blew up", "-", "-"].map(|text| Cell::right(text).styled(RED)));
        }
        RunOutcome::Failed { step, .. } => {
            row.push(Cell::right(format!("failed at step {step}")).styled(RED));
            row.extend(["-", "-"].map(Cell::right));
        }
    }
    match point.cost.time {
        Some(cost) => {
            row.extend([cost.least, cost.median, cost.largest].map(|t| Cell::right(time(t))))
        }
        None => row.extend(["-"; 3].map(Cell::right)),
    }
    match point.cost.work {
        Some(work) => row.extend(
            [work.force_evaluations, work.factorisations, work.iterations]
                .map(|count| Cell::right(count.to_string())),
        ),
        None => row.extend(["-"; 3].map(Cell::right)),
    }
    row
}
