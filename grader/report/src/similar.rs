//! Shared parts of the sources of hand-ins and their places, as text and as CSV. People judge.

use std::io::{self, Write};

use grader::boundary::printed::InertCsv;
use grader::class::similar::{Place, Run, Similarity};

use crate::table::{self, BOLD, Cell, DIM, ODD, header};
use crate::wrap::wrap;

/// Most pairs that the text shows; the CSV file has all.
const PAIRS_SHOWN: usize = 100;

/// Most runs that the text shows of a pair.
const RUNS_SHOWN: usize = 5;

/// Column names of the CSV file.
const COLUMNS: [&str; 13] = [
    "first",
    "second",
    "first_part",
    "second_part",
    "first_shared",
    "second_shared",
    "tokens",
    "first_file",
    "first_line",
    "first_last_line",
    "second_file",
    "second_line",
    "second_last_line",
];

/// Writes the pairs as text, in lines of at most `width` characters.
///
/// # Errors
/// If writing fails.
pub fn write(out: &mut dyn Write, similarity: &Similarity, width: usize) -> io::Result<()> {
    let mut text = Vec::new();
    write_lines(&mut text, similarity)?;
    out.write_all(wrap(&String::from_utf8_lossy(&text), width).as_bytes())
}

fn write_lines(out: &mut dyn Write, similarity: &Similarity) -> io::Result<()> {
    let Similarity { config, common, hand_ins, equal, pairs, not_compared } = similarity;
    writeln!(out, "{BOLD}Shared code, for people to judge{BOLD:#}")?;
    for names in equal {
        let (count, names) = (names.len(), names.join(", "));
        writeln!(out, "  {BOLD}the same source{BOLD:#}, token by token, {count} times: {names}")?;
    }
    let name = |place: usize| hand_ins[place].name.clone();
    let mut cells = vec![header(&["", "first", "its part", "second", "its part"], 0..1)];
    for (number, pair) in pairs.iter().take(PAIRS_SHOWN).enumerate() {
        let [first, second] = pair.hand_ins;
        let part = |side: usize| Cell::right(percent(similarity.part(pair, side)));
        cells.push(vec![
            Cell::right((number + 1).to_string()),
            Cell::left(name(first)),
            part(0),
            Cell::left(name(second)),
            part(1),
        ]);
    }
    if pairs.is_empty() {
        let from = percent(config.listed_from);
        writeln!(out, "  no pair shares {from} of the tokens of either hand-in")?;
    } else {
        table::write(out, &cells)?;
    }
    for (number, pair) in pairs.iter().take(PAIRS_SHOWN).enumerate() {
        let [first, second] = pair.hand_ins;
        writeln!(out, "\n{BOLD}{}  {}, {}{BOLD:#}", number + 1, name(first), name(second))?;
        for Run { tokens, places: [first, second] } in pair.runs.iter().take(RUNS_SHOWN) {
            writeln!(out, "  {tokens:>6} tokens  {}  and  {}", lines(first), lines(second))?;
        }
        if let Some(more) = pair.runs.len().checked_sub(RUNS_SHOWN).filter(|more| *more > 0) {
            writeln!(out, "  {DIM}and {more} shorter runs{DIM:#}")?;
        }
    }
    if pairs.len() > PAIRS_SHOWN {
        let more = pairs.len() - PAIRS_SHOWN;
        writeln!(
            out,
            "\n  {ODD}and {more} more pairs, which share less; -o DIR writes all{ODD:#}"
        )?;
    }
    writeln!(out)?;
    for (name, reason) in not_compared {
        writeln!(out, "  {ODD}not compared: {name}: {reason}{ODD:#}")?;
    }
    for hand_in in hand_ins.iter().filter(|hand_in| hand_in.unread > 0) {
        let unread = hand_in.unread;
        writeln!(
            out,
            "  {ODD}{}: source files not read, over 1 MiB or beyond 4 MiB of the hand-in: {unread}{ODD:#}",
            hand_in.name
        )?;
    }
    let sum = |of: fn(&grader::class::similar::HandInTokens) -> usize| -> usize {
        hand_ins.iter().map(of).sum()
    };
    writeln!(
        out,
        "  {BOLD}{} hand-ins{BOLD:#}: {} tokens, of which {} are starter code and {} are common",
        hand_ins.len(),
        sum(|hand_in| hand_in.tokens),
        sum(|hand_in| hand_in.starter),
        sum(|hand_in| hand_in.common),
    )?;
    writeln!(
        out,
        "  {DIM}Names, values, comments, layout and the order of functions do not count. Every shared run of {} tokens is \
         found, none below {}. Common is what more than {} hand-ins have, where those with the same source count once: \
         the first of them is compared with the others. Part: of the tokens that are neither. Listed from {}.{DIM:#}",
        config.found_from(),
        config.k,
        common,
        percent(config.listed_from),
    )
}

/// The pairs as CSV, with a header line: a row for each run.
///
/// # Errors
/// Never in practice: the output is memory.
pub fn csv(similarity: &Similarity) -> csv::Result<Vec<u8>> {
    let mut table = InertCsv::new(COLUMNS)?;
    for pair in &similarity.pairs {
        let names = pair.hand_ins.map(|place| similarity.hand_ins[place].name.clone());
        let parts = [0, 1].map(|side| format!("{:.4}", similarity.part(pair, side)));
        let shared = pair.shared.map(|shared| shared.to_string());
        for Run { tokens, places } in &pair.runs {
            let places = places.iter().flat_map(|Place { file, first, last }| {
                [file.clone(), first.to_string(), last.to_string()]
            });
            let record = names.iter().chain(&parts).chain(&shared).cloned();
            table.row(record.chain([tokens.to_string()]).chain(places))?;
        }
    }
    table.bytes()
}

/// `src/a.cpp:3-17`.
fn lines(Place { file, first, last }: &Place) -> String {
    format!("{file}:{first}-{last}")
}

/// Rounded down: 100 % means all.
fn percent(part: f64) -> String {
    format!("{} %", (100.0 * part).floor())
}
