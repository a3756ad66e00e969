//! Cost of comparing two traces, against pandas, numpy and numdiff. See README.md in this folder.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use fastrand::Rng;
use grader::compare::{Expectation, Tolerances, compare};
use grader::verdict::Verdict;
use scene::Dimension;
use scene::state::StateView;
use scene::trace::csv::CsvWriter;
use scene::trace::fosssim::FosssimWriter;
use scene::trace::{self, Shape, TraceFormat, TraceWriter};

/// 2.1 million numbers a trace: some 40 MB of text.
const SHAPE: Shape = Shape { dimension: Dimension::Two, n_particles: 500 };
const STATES: u64 = 1050;
const TIME_STEP: f64 = 0.01;

/// Reads two traces named on the command line, and prints the seconds that this and the largest difference took.
const PANDAS: &str = "
import sys, time, pandas, numpy
start = time.perf_counter()
a, b = (pandas.read_csv(name).to_numpy() for name in sys.argv[1:3])
assert numpy.abs(a - b).max() < 1e-9
print(time.perf_counter() - start)
";
const NUMPY_TEXT: &str = "
import sys, time, numpy
start = time.perf_counter()
a, b = (numpy.loadtxt(name, delimiter=',', skiprows=1) for name in sys.argv[1:3])
assert numpy.abs(a - b).max() < 1e-9
print(time.perf_counter() - start)
";
const NUMPY_BINARY: &str = "
import sys, time, numpy
start = time.perf_counter()
a, b = (numpy.fromfile(name) for name in sys.argv[1:3])
assert numpy.abs(a - b).max() < 1e-9
print(time.perf_counter() - start)
";

/// Writes a trace and a second one that differs from it by about 1e-15.
fn write(folder: &Path, format: TraceFormat) -> [PathBuf; 2] {
    ["oracle", "got"].map(|name| {
        let path = folder.join(name).with_extension(format.extension());
        let file = BufWriter::new(File::create(&path).expect("a file can be made"));
        let mut writer: Box<dyn TraceWriter> = match format {
            TraceFormat::Csv => Box::new(CsvWriter::new(file, SHAPE).expect("it can be written")),
            TraceFormat::Fosssim => Box::new(FosssimWriter::new(file)),
        };
        let mut random = Rng::with_seed(1);
        let mut numbers = |change: f64| -> Vec<f64> {
            (0..SHAPE.n_coordinates()).map(|_| (random.f64() - 0.5) * 8.0 + change).collect()
        };
        for step in 0..STATES {
            let change = if name == "got" { 1e-15 } else { 0.0 };
            let (positions, velocities) = (numbers(change), numbers(change));
            let time = step as f64 * TIME_STEP;
            let state = StateView { step, time, positions: &positions, velocities: &velocities };
            writer.write(state).expect("it can be written");
        }
        path
    })
}

/// The seconds that a comparison of ours takes.
fn ours([oracle, got]: &[PathBuf; 2], format: TraceFormat) -> f64 {
    let start = Instant::now();
    let mut oracle = trace::open(oracle, format, SHAPE).expect("it can be read");
    let mut got = trace::open(got, format, SHAPE).expect("it can be read");
    let expectation = Expectation { shape: SHAPE, time_step: TIME_STEP, n_states: STATES };
    let comparison = compare(oracle.as_mut(), &mut got, expectation, Tolerances::COURSE);
    assert!(comparison.verdict == Verdict::Pass, "{:?}", comparison.verdict);
    start.elapsed().as_secs_f64()
}

/// The seconds that a peer in Python says it took; `None` where it cannot run.
fn python(program: &str, [oracle, got]: &[PathBuf; 2]) -> Option<f64> {
    let mut command = Command::new("python3");
    let output = command.args(["-c", program]).args([oracle, got]).output().ok()?;
    String::from_utf8_lossy(&output.stdout).trim().parse().ok()
}

/// The seconds that numdiff takes; `None` where it is not installed.
fn numdiff([oracle, got]: &[PathBuf; 2]) -> Option<f64> {
    let mut command = Command::new("numdiff");
    command.args(["-q", "-s", ",\n", "-a", "1e-9"]).args([oracle, got]);
    let start = Instant::now();
    let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status().ok()?;
    status.success().then(|| start.elapsed().as_secs_f64())
}

fn main() -> io::Result<()> {
    let timed = std::env::args().any(|argument| argument == "--bench");
    let most_rounds = if timed { 10 } else { 1 };
    let folder = tempfile::tempdir()?;
    let text = write(folder.path(), TraceFormat::Csv);
    let binary = write(folder.path(), TraceFormat::Fosssim);
    let mut out = io::stdout().lock();
    for (name, pair) in [("CSV", &text), ("binary", &binary)] {
        let megabytes = fs::metadata(&pair[0])?.len() as f64 / 1e6;
        writeln!(out, "{name}: two traces of {megabytes:.1} MB")?;
    }
    let contestants: [(&str, &dyn Fn() -> Option<f64>); 6] = [
        ("grade, CSV", &|| Some(ours(&text, TraceFormat::Csv))),
        ("pandas, CSV", &|| python(PANDAS, &text)),
        ("numpy.loadtxt, CSV", &|| python(NUMPY_TEXT, &text)),
        ("numdiff, CSV", &|| numdiff(&text)),
        ("grade, binary", &|| Some(ours(&binary, TraceFormat::Fosssim))),
        ("numpy.fromfile, binary", &|| python(NUMPY_BINARY, &binary)),
    ];
    let mut times: [Vec<f64>; 6] = Default::default();
    for _ in 0..most_rounds {
        for (times, (_, run)) in times.iter_mut().zip(&contestants) {
            // The slow ones run less often.
            if times.iter().sum::<f64>() < 5.0 {
                times.extend(run());
            }
        }
    }
    for (times, (name, _)) in times.iter().zip(&contestants) {
        let rounds = times.len();
        match times.iter().copied().reduce(f64::min) {
            Some(least) => writeln!(out, "{name:24} least of {rounds:2}: {least:.3} s")?,
            None => writeln!(out, "{name:24} not installed")?,
        }
    }
    Ok(())
}
