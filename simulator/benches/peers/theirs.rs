//! The peers' side: programs that are built and run as their authors say.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use scene::Scene;
use scene::trace::{self, Shape, State, TraceError, TraceFormat};
use tempfile::TempDir;

use crate::method::{
    FACTORISED, FMS_ITERATIONS, METHODS, Method, NEWTON_TOLERANCE, Peer, STIFFNESS,
};

/// The peers that are there, or why one is not.
pub(crate) struct Peers {
    eigen: Result<PathBuf, String>,
    cholmod: Result<PathBuf, String>,
    python: Result<String, String>,
    pardiso: Result<String, String>,
    taichi: Result<String, String>,
    triangles: Result<PathBuf, String>,
    triangles_cholmod: Result<PathBuf, String>,
    scikit_fem: Result<String, String>,
    // Its files are removed when this is dropped.
    scratch: TempDir,
}

/// Results of a run of a peer.
pub(crate) struct Run {
    /// Time in ns a step.
    pub(crate) time: f64,
    /// The first coordinate at the end; of a matrix, its Frobenius norm over the modulus.
    pub(crate) x0: f64,
    /// Steps whose matrix it could not factorise as it does the others.
    pub(crate) refused: u64,
}

/// The factorisation of a matrix.
pub(crate) struct Factorisation {
    /// Its least time in ns.
    pub(crate) time: f64,
    /// Multiplications and additions, by the program's own count.
    pub(crate) operations: f64,
}

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/projected_newton.py");

const PARDISO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/pardiso.py");

const TAICHI: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/taichi_symplectic.py");

const CHOLMOD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/cholmod.cpp");

const TRIANGLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/triangles.cpp");

const TAICHI_TRIANGLES: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/taichi_triangles.py");

const SCIKIT_FEM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/skfem_triangles.py");

impl Peers {
    /// Builds and looks for what is there.
    ///
    /// # Errors
    /// Where there is no place for temporary files.
    pub(crate) fn find(source: &Path) -> io::Result<Self> {
        let scratch = TempDir::new()?;
        let python = versions("numpy", &["numpy", "scipy"]);
        let pardiso = versions("pypardiso", &["pypardiso", "mkl"]);
        let taichi = versions("taichi", &["taichi"]);
        let build = |source, line| build(source, line, scratch.path());
        let eigen = build(source, BUILD);
        let cholmod = build(Path::new(CHOLMOD), BUILD);
        let triangles = build(Path::new(TRIANGLES), BUILD);
        let triangles_cholmod = build(Path::new(TRIANGLES), "// build with CHOLMOD: ");
        let scikit_fem = versions("skfem", &["scikit-fem"]);
        Ok(Self {
            eigen,
            cholmod,
            python,
            pardiso,
            taichi,
            triangles,
            triangles_cholmod,
            scikit_fem,
            scratch,
        })
    }

    /// The versions of what the peers are made with, a line each; or why they are not there.
    pub(crate) fn versions(&self) -> [String; 6] {
        let compiler = || output(Command::new("g++").arg("--version"));
        let eigen = self.eigen.as_ref().or(self.triangles.as_ref());
        let eigen = eigen.map_err(String::clone).and_then(|_| compiler());
        let version = |program| output(with_blas(program).arg("version"));
        let cholmod = self.cholmod.as_ref().map_err(String::clone).and_then(version);
        let or_why = |result: Result<String, String>| {
            let line = result.unwrap_or_else(|reason| format!("not there: {reason}"));
            line.lines().next().unwrap_or_default().to_owned()
        };
        let scripts = [&self.python, &self.pardiso, &self.taichi, &self.scikit_fem];
        let [python, pardiso, taichi, scikit_fem] = scripts.map(|told| or_why(told.clone()));
        [or_why(eigen), or_why(cholmod), python, pardiso, taichi, scikit_fem]
    }

    /// Runs the method's peer on a body of so many segments a side.
    ///
    /// # Errors
    /// The reason why that cannot be measured.
    pub(crate) fn run(&self, method: &Method, segments: usize, steps: u64) -> Result<Run, String> {
        let mut command = self.command(method, segments, steps)?;
        parse(&output(&mut command)?).ok_or_else(|| "the peer prints no times".into())
    }

    /// A peer's factorisations of the first matrices of a net that are positive definite.
    ///
    /// # Errors
    /// The reason why that cannot be measured.
    pub(crate) fn factorisation(
        &self,
        peer: Peer,
        segments: usize,
    ) -> Result<Factorisation, String> {
        let method = METHODS.iter().find(|method| method.peer == peer);
        let method = method.ok_or("it is not among the peers")?;
        let line = output(&mut self.command(method, segments, FACTORISED)?)?;
        let time = field(&line, "factor_ms").filter(|time| time.is_finite());
        let time = time.ok_or("the peer refused every matrix")? * 1e6;
        let operations = field(&line, "factor_flops").ok_or("the peer counts no operations")?;
        Ok(Factorisation { time, operations })
    }

    /// The largest distance, in one coordinate, between our positions and the peer's after so many
    /// steps: of all particles where the peer tells them, else in the coordinate that it tells.
    ///
    /// # Errors
    /// The reason why it is not known.
    pub(crate) fn difference(
        &self,
        method: &Method,
        segments: usize,
        steps: u64,
        (scene, positions): (&Scene, &[f64]),
    ) -> Result<f64, String> {
        if method.peer != Peer::Python {
            return Ok((self.run(method, segments, steps)?.x0 - positions[0]).abs());
        }
        let path = self.scratch.path().join("states.csv");
        output(self.command(method, segments, steps)?.arg("--dump").arg(&path))?;
        let last = last_state(&path, Shape::of(scene)).map_err(|error| error.to_string())?;
        let pairs = last.positions.iter().zip(positions);
        Ok(pairs.map(|(theirs, ours)| (theirs - ours).abs()).fold(0.0, f64::max))
    }

    fn command(&self, method: &Method, segments: usize, steps: u64) -> Result<Command, String> {
        let body = |command: &mut Command| {
            command.arg(segments.to_string()).arg(method.time_step.to_string());
            command.arg(steps.to_string()).arg(STIFFNESS.to_string());
        };
        match method.peer {
            Peer::Eigen(mode) => {
                let mut command = Command::new(self.eigen.as_ref()?);
                body(command.arg(mode));
                command.arg(FMS_ITERATIONS.to_string());
                Ok(command)
            }
            Peer::Cholmod(mode) => {
                let mut command = with_blas(self.cholmod.as_ref()?);
                body(command.arg(mode));
                command.arg(FMS_ITERATIONS.to_string());
                Ok(command)
            }
            Peer::Python => {
                self.python.as_ref()?;
                let mut command = Command::new("python3");
                body(command.arg(SCRIPT));
                command.arg(NEWTON_TOLERANCE.to_string()).args(["--spring", "green"]);
                Ok(command)
            }
            Peer::Pardiso => {
                self.pardiso.as_ref()?;
                let mut command = Command::new("python3");
                body(command.arg(PARDISO));
                Ok(command)
            }
            Peer::Taichi => {
                self.taichi.as_ref()?;
                let mut command = Command::new("python3");
                body(command.env("ENABLE_TAICHI_HEADER_PRINT", "False").arg(TAICHI));
                Ok(command)
            }
            Peer::Triangles(mode) => {
                let mut command = Command::new(self.triangles.as_ref()?);
                body(command.arg(mode));
                Ok(command)
            }
            Peer::TrianglesCholmod => {
                let mut command = with_blas(self.triangles_cholmod.as_ref()?);
                body(command.arg("lie"));
                Ok(command)
            }
            Peer::TaichiTriangles => {
                self.taichi.as_ref()?;
                let mut command = Command::new("python3");
                body(command.env("ENABLE_TAICHI_HEADER_PRINT", "False").arg(TAICHI_TRIANGLES));
                Ok(command)
            }
            Peer::ScikitFem => {
                self.scikit_fem.as_ref()?;
                let mut command = Command::new("python3");
                body(command.arg(SCIKIT_FEM));
                Ok(command)
            }
        }
    }
}

/// A program with the kernels of OpenBLAS that fit this processor: it takes the oldest ones for processors that it does not
/// know.
fn with_blas(program: &PathBuf) -> Command {
    let mut command = Command::new(program);
    #[cfg(target_arch = "x86_64")]
    if std::env::var_os("OPENBLAS_CORETYPE").is_none() {
        if std::arch::is_x86_feature_detected!("avx512f") {
            command.env("OPENBLAS_CORETYPE", "SkylakeX");
        } else if std::arch::is_x86_feature_detected!("avx2") {
            command.env("OPENBLAS_CORETYPE", "Haswell");
        }
    }
    command
}

/// The versions of Python and of these packages; or why their module cannot be imported.
fn versions(module: &str, packages: &[&str]) -> Result<String, String> {
    let script = "import importlib.metadata, platform, sys\n\
        module, names = sys.argv[1], sys.argv[2:]\n\
        try:\n \
            told = ['%s %s' % (name, importlib.metadata.version(name)) for name in names]\n \
            importlib.import_module(module)\n\
        except ImportError as reason:\n \
            sys.exit('error: python3 has no %s (pip install %s): %s' % (module, names[0], reason))\n\
        print(' · '.join(['Python ' + platform.python_version()] + told))";
    let mut command = Command::new("python3");
    command.env("ENABLE_TAICHI_HEADER_PRINT", "False").args(["-c", script, module]);
    output(command.args(packages))
}

/// Before the line that builds a peer, in the head of its source.
const BUILD: &str = "// build: ";

/// The peer, built in `folder` with the line in the head of its source that begins like this.
fn build(source: &Path, line: &str, folder: &Path) -> Result<PathBuf, String> {
    let missing = || format!("there is no {}", source.display());
    let text = fs::read_to_string(source).map_err(|_| missing())?;
    let name = source.file_name().ok_or_else(missing)?;
    let line = text.lines().find_map(|each| each.strip_prefix(line));
    let line = line.ok_or("the head of the C++ peer has no build line")?;
    let target = line.split_whitespace().skip_while(|word| *word != "-o").nth(1);
    let target = target.ok_or("the build line of the C++ peer names no output")?;
    fs::write(folder.join(name), &text).map_err(|error| error.to_string())?;
    output(Command::new("sh").args(["-c", line]).current_dir(folder))?;
    Ok(folder.join(target))
}

fn last_state(path: &Path, shape: Shape) -> Result<State, TraceError> {
    let mut states = trace::open(path, TraceFormat::Csv, shape)?;
    let mut last = State::zeros(shape);
    while states.read(&mut last)? {}
    Ok(last)
}

/// Output of a program; or, if it fails, the line of its error message with the cause.
pub(crate) fn output(command: &mut Command) -> Result<String, String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let Output { status, stdout, stderr } =
        command.output().map_err(|error| format!("{program}: {error}"))?;
    if status.success() {
        return Ok(String::from_utf8_lossy(&stdout).trim().to_owned());
    }
    let stderr = String::from_utf8_lossy(&stderr);
    // The lines around the error only name its place.
    let line = stderr.lines().find(|line| line.to_lowercase().contains("error"));
    let line = line.or_else(|| stderr.lines().next());
    Err(line.map_or_else(|| format!("{program} failed: {status}"), str::to_owned))
}

fn parse(line: &str) -> Option<Run> {
    // Of springs, the times a step are rounded to 0.1 µs; those a spring are not so coarse.
    let of_springs = || Some(field(line, "ns_per_spring_step")? * field(line, "springs")?);
    let time = field(line, "ns_per_step").or_else(of_springs)?;
    let refused = field(line, "refused").unwrap_or(0.0) as u64;
    Some(Run { time, x0: field(line, "x0")?, refused })
}

fn field(line: &str, name: &str) -> Option<f64> {
    let mut words = line.split_whitespace();
    let value = words.find_map(|word| word.strip_prefix(name)?.strip_prefix('='))?;
    value.parse().ok()
}
