//! Resource limits of a run.

use serde::{Deserialize, Serialize};

/// Threads of the keeper, including the one that starts the program.
#[cfg(target_os = "linux")]
pub(super) const KEEPER_THREADS: u64 = 3;

/// Largest limit of time, in seconds.
const MAX_SECONDS: f64 = 1e6;

/// Largest limit of any count.
const MAX_COUNT: f64 = 1e15;

/// Runs of full length that a hand-in may make by default, all together.
const LONG_RUNS: f64 = 20.0;

/// Resource limits of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Processor time of all its processes, in seconds.
    pub cpu: f64,
    /// Time from start to end, in seconds.
    pub wall: f64,
    /// Memory of all its processes, in bytes.
    pub memory: u64,
    /// Processes and threads at the same time.
    pub processes: u64,
    /// Bytes in its scratch folder, including its trace.
    pub trace: u64,
    /// Bytes of its standard output.
    pub stdout: u64,
    /// Bytes of its standard error.
    pub stderr: u64,
    /// Files and folders in its scratch folder.
    pub files: u64,
    /// Seconds of all runs of a hand-in together, if set. The sandbox, which knows one run, leaves it to the caller.
    pub budget: Option<f64>,
}

impl Limits {
    /// The name and meaning of each limit.
    pub const NAMES: [(&str, &str); 9] = [
        ("cpu", "seconds of processor time"),
        ("wall", "seconds from start to end"),
        ("memory", "bytes of memory"),
        ("processes", "processes and threads"),
        ("trace", "bytes in the scratch folder"),
        ("stdout", "bytes of standard output"),
        ("stderr", "bytes of standard error"),
        ("files", "files in the scratch folder"),
        ("budget", "seconds of all runs of a hand-in together"),
    ];

    /// Seconds of all runs of a hand-in together: by default those of 20 runs that last as long as they may, and not less
    /// than with the default limits.
    pub fn budget(&self) -> f64 {
        self.budget.unwrap_or(LONG_RUNS * self.wall.max(Self::default().wall))
    }

    /// Sets the limit with this name.
    ///
    /// # Errors
    /// A message, if the name is unknown or the value out of range.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), String> {
        let seconds = match name {
            "cpu" => Some(&mut self.cpu),
            "wall" => Some(&mut self.wall),
            "budget" => Some(self.budget.get_or_insert(value)),
            _ => None,
        };
        if let Some(seconds) = seconds {
            if !(value > 0.0 && value <= MAX_SECONDS) {
                return Err(format!(
                    "{name} must be above 0 and at most {MAX_SECONDS} s, not {value}"
                ));
            }
            *seconds = value;
            return Ok(());
        }
        let count = match name {
            "memory" => &mut self.memory,
            "processes" => &mut self.processes,
            "trace" => &mut self.trace,
            "stdout" => &mut self.stdout,
            "stderr" => &mut self.stderr,
            "files" => &mut self.files,
            _ => {
                let names = Self::NAMES.map(|(name, _)| name).join(", ");
                return Err(format!("unknown limit {name}\n  help: the limits are {names}"));
            }
        };
        if !(1.0..=MAX_COUNT).contains(&value) || value.fract() != 0.0 {
            return Err(format!(
                "{name} must be a whole number from 1 to {MAX_COUNT:e}, not {value}"
            ));
        }
        *count = value as u64;
        Ok(())
    }

    /// The default limits of builds.
    pub fn of_builds() -> Self {
        const GIB: u64 = 1 << 30;
        Self {
            cpu: 600.0,
            wall: 600.0,
            memory: 4 * GIB,
            processes: 512,
            trace: 2 * GIB,
            files: 100_000,
            ..Self::default()
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        const MIB: u64 = 1 << 20;
        Self {
            cpu: 30.0,
            wall: 60.0,
            memory: 2048 * MIB,
            processes: 64,
            trace: 512 * MIB,
            stdout: 4 * MIB,
            stderr: 4 * MIB,
            files: 64,
            budget: None,
        }
    }
}

/// An exceeded limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Exceeded {
    /// Processor time.
    Cpu,
    /// Time from start to end.
    Wall,
    /// Memory.
    Memory,
    /// Processes.
    Processes,
    /// Bytes in the scratch folder.
    Trace,
    /// Bytes of standard output.
    Stdout,
    /// Bytes of standard error.
    Stderr,
    /// Files in the scratch folder.
    Files,
}
