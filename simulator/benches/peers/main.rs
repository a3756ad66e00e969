//! The simulator compared with its peers, on the elastic square of the slides and on a sheet of triangles: times, ratios, growth exponents.
//!
//! Ours and theirs alternate in one run, so that both meet the same machine. A time is the least of the
//! repeats; the ratio is theirs over ours; the growth exponent `p` of `time ∝ elements^p` is taken between
//! the two largest bodies. See README.md in the folder above.

mod limits;
mod machine;
mod measure;
mod method;
mod ours;
mod table;
mod theirs;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use scene::output::OutputFile;

use crate::limits::Limits;
use crate::method::METHODS;
use crate::ours::Taken;
use crate::table::Tables;
use crate::theirs::Peers;

/// Measure the simulator and the programs that one would otherwise run, and print a table.
#[derive(Parser)]
#[command(name = "peers")]
struct Cli {
    /// Only these rows
    #[arg(long, value_enum, value_delimiter = ',', value_name = "ROW")]
    only: Vec<Row>,

    /// Only bodies of these many segments a side
    #[arg(long = "n", value_delimiter = ',', value_name = "SEGMENTS", value_parser = parse_segments)]
    segments: Vec<usize>,

    /// How often each time is taken
    #[arg(long, value_name = "COUNT", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    repeats: u64,

    /// Source of the C++ peer; cargo starts benches in the folder `simulator`
    #[arg(long, value_name = "FILE", default_value_os_t = default_peer())]
    peer: PathBuf,

    /// Write the tables to this file too, as Markdown
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,

    /// Take the first steps of a net by this integrator, and print what they took
    #[arg(long, value_name = "INTEGRATOR", hide = true, requires = "grown")]
    grow: Option<String>,

    /// Segments a side of that net
    #[arg(long = "segments", value_name = "COUNT", hide = true)]
    grown: Option<u64>,

    /// Passed by `cargo bench`; of no effect
    #[arg(long, hide = true)]
    bench: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Row {
    Lie,
    LieCholmod,
    LiePardiso,
    Symplectic,
    SymplecticTaichi,
    Fms,
    FmsCholmod,
    Pn,
    Triangles,
    TrianglesCholmod,
    TrianglesAssembly,
    TrianglesSymplectic,
    TrianglesTaichi,
    Factor,
    Growth,
}

fn default_peer() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/peers/eigen_lie.cpp")
}

fn parse_segments(text: &str) -> Result<usize, String> {
    let sizes = method::sizes();
    let segments = text.parse().ok().filter(|segments| sizes.contains(segments));
    segments.ok_or_else(|| format!("the bodies have {sizes:?} segments a side"))
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    // Large scenes are stepped inside the pool, as `simulate` does.
    match rayon::scope(|_| run(&cli)) {
        Ok(()) => ExitCode::SUCCESS,
        // A closed pipe: its reader needs no more of the table.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(io::stderr(), "error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn create(path: &Path) -> io::Result<OutputFile> {
    let named = |error| io::Error::other(format!("{}: {error}", path.display()));
    OutputFile::create(path).map_err(named)
}

fn run(cli: &Cli) -> io::Result<()> {
    let mut output = io::stdout().lock();
    let grown = METHODS.iter().find(|method| Some(method.integrator) == cli.grow.as_deref());
    if let (Some(method), Some(segments)) = (grown, cli.grown) {
        let taken = Taken::here(method, segments).map_err(io::Error::other)?;
        return writeln!(output, "{taken}");
    }
    // Before the minutes of measuring, not after them.
    let markdown = cli.markdown.as_deref().map(create).transpose()?;

    let wanted = |row: Row| cli.only.is_empty() || cli.only.contains(&row);
    let peers = Peers::find(&cli.peer)?;
    let limits = Limits::measure();
    let mut tables = Tables::new(&mut output);
    tables.limits(&limits)?;
    let rows = [
        Row::Lie,
        Row::LieCholmod,
        Row::LiePardiso,
        Row::Symplectic,
        Row::SymplecticTaichi,
        Row::Fms,
        Row::FmsCholmod,
        Row::Pn,
        Row::Triangles,
        Row::TrianglesCholmod,
        Row::TrianglesAssembly,
        Row::TrianglesSymplectic,
        Row::TrianglesTaichi,
    ];
    for (_, method) in rows.into_iter().zip(&METHODS).filter(|(row, _)| wanted(*row)) {
        tables.start(method)?;
        let mut cells = Vec::new();
        for (segments, target) in method.targets {
            if cli.segments.is_empty() || cli.segments.contains(segments) {
                let cell = measure::cell(method, *segments, *target, cli.repeats, &peers);
                tables.cell(method, &cell, &limits)?;
                cells.push(cell);
            }
        }
        tables.end(&cells)?;
    }
    if wanted(Row::Factor) {
        tables.factors(&limits, cli.repeats, &peers)?;
    }
    if wanted(Row::Growth) {
        tables.growth(&Taken::by_child)?;
    }
    if let Some(mut file) = markdown {
        file.write_all(machine::describe(&peers).as_bytes())?;
        file.write_all(tables.markdown().as_bytes())?;
        file.commit()?;
    }
    Ok(())
}
