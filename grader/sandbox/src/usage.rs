//! Resource usage of the processes of a run, read from `/proc`.
//!
//! - **Processor time**: the larger of two sums: living processes and the children they waited for; or living processes
//!   and all ended ones as last seen, since a parent need not wait for its children.
//! - **Memory**: resident pages, each shared page once, page tables, swapped pages, the capacity of sockets, and where no
//!   control group counts it, the kernel's memory for mappings.
//! - **Bytes written**: pages of files on disk that became dirty, of living processes and of ended ones as last seen.

use std::collections::HashMap;
use std::fs;
use std::io::Read;
use std::os::unix::fs::MetadataExt;

/// Capacity of a socket in bytes: the kernel's default buffer.
const SOCKET_BUFFER: u64 = 212_992;

/// Memory of the kernel for a mapping and for the shared page that it may hide, in bytes.
const MAPPING: u64 = 6144;

/// Open descriptors per process assumed to be files; each further one may be a socket.
const FILES: u64 = 16;

/// Resource usage of a process tree so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Usage {
    /// Seconds of processor time.
    pub(super) cpu: f64,
    /// Bytes of memory.
    pub(super) memory: u64,
    /// Threads of all processes.
    pub(super) threads: u64,
    /// Bytes written to disk, without those of removed files that never got there.
    pub(super) written: i64,
}

/// Tracks the usage of a process tree.
#[derive(Debug, Default)]
pub(super) struct Meter {
    /// Whether to count mappings.
    counts_mappings: bool,
    /// Whether to count bytes written.
    counts_writes: bool,
    /// Each process when last seen.
    seen: HashMap<i32, Seen>,
    /// The sum over ended processes.
    ended: Seen,
}

/// Resources used by a process.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    /// Processor time in seconds.
    cpu: f64,
    /// Bytes written to disk.
    written: i64,
}

impl Meter {
    /// A meter that counts mappings, and bytes written.
    pub(super) fn new(counts_mappings: bool, counts_writes: bool) -> Self {
        Self { counts_mappings, counts_writes, ..Self::default() }
    }

    /// Usage of the process `root` and all its descendants. Stops at more than `enough` threads, because a tree may
    /// grow faster than it is read. Counts shared pages once only if all pages together exceed `memory`.
    pub(super) fn measure(&mut self, root: i32, enough: u64, memory: u64) -> Usage {
        let (mut usage, mut own, mut waited) = (Usage::default(), 0.0, 0.0);
        let mut processes = vec![root];
        let mut mapped = 0;
        let mut seen = HashMap::new();
        let mut next = 0;
        while let Some(&process) = processes.get(next) {
            next += 1;
            let Some(stat) = Stat::of(process) else { continue };
            own += stat.own;
            waited += stat.waited;
            usage.threads += stat.threads;
            usage.memory += stat.resident + extra_memory(process);
            if self.counts_mappings {
                mapped += MAPPING * mappings(process, (memory - mapped) / MAPPING);
                if mapped > memory {
                    // Each further look takes long, and the tree grows meanwhile.
                    usage.memory += mapped;
                    return usage;
                }
            }
            let written = if self.counts_writes { written(process) } else { 0 };
            usage.written += written;
            seen.insert(process, Seen { cpu: stat.own, written });
            if usage.threads > enough {
                break;
            }
            children(process, &mut processes);
        }
        for (_, last) in self.seen.iter().filter(|(process, _)| !seen.contains_key(process)) {
            self.ended.cpu += last.cpu;
            self.ended.written += last.written;
        }
        self.seen = seen;
        usage.cpu = own + waited.max(self.ended.cpu);
        usage.written += self.ended.written;
        usage.memory += mapped;
        if usage.memory > memory {
            let proportional = |process: &i32| proportional_memory(*process);
            usage.memory = mapped + processes.iter().map(proportional).sum::<u64>();
        }
        usage
    }
}

/// Visits the descendants of the process `root`, at most `most` of them.
pub(super) fn visit_descendants(root: i32, most: usize, visit: impl Fn(i32)) {
    let mut found = Vec::new();
    children(root, &mut found);
    let mut next = 0;
    while let Some(&process) = found.get(next).filter(|_| next < most) {
        visit(process);
        children(process, &mut found);
        next += 1;
    }
}

/// Bytes in deleted files that descendants of `root` hold open.
pub(super) fn unnamed_files(root: i32) -> u64 {
    const BLOCK: u64 = 512;
    let bytes = std::cell::RefCell::new(HashMap::new());
    visit_descendants(root, usize::MAX, |process| {
        let open = fs::read_dir(format!("/proc/{process}/fd")).into_iter().flatten().flatten();
        for metadata in open.filter_map(|descriptor| fs::metadata(descriptor.path()).ok()) {
            if metadata.is_file() && metadata.nlink() == 0 {
                let file = (metadata.dev(), metadata.ino());
                bytes.borrow_mut().insert(file, metadata.blocks() * BLOCK);
            }
        }
    });
    bytes.into_inner().values().sum()
}

fn children(process: i32, found: &mut Vec<i32>) {
    for thread in fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten() {
        let list = fs::read_to_string(thread.path().join("children")).unwrap_or_default();
        found.extend(list.split_ascii_whitespace().filter_map(|number| number.parse::<i32>().ok()));
    }
}

/// Fields of `/proc/PID/stat`.
struct Stat {
    /// Its own processor time in seconds.
    own: f64,
    /// Processor time of the children it waited for, in seconds.
    waited: f64,
    threads: u64,
    /// Bytes of resident pages.
    resident: u64,
}

impl Stat {
    fn of(process: i32) -> Option<Self> {
        let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
        // The name in parentheses may contain any character; proc_pid_stat(5) counts fields from 1, and the name is 2.
        let (_, fields) = stat.rsplit_once(") ")?;
        let fields: Vec<&str> = fields.split(' ').collect();
        let field = |number: usize| -> u64 {
            fields.get(number - 3).and_then(|text| text.parse().ok()).unwrap_or(0)
        };
        let seconds = |ticks: u64| ticks as f64 / rustix::param::clock_ticks_per_second() as f64;
        Some(Self {
            own: seconds(field(14) + field(15)),
            waited: seconds(field(16) + field(17)),
            threads: field(20),
            resident: field(24) * rustix::param::page_size() as u64,
        })
    }
}

/// Bytes of page tables, swapped pages, and buffers of possible sockets.
fn extra_memory(process: i32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let kibibytes = sum_of(&status, &["VmPTE:", "VmSwap:"]);
    let descriptors = fs::read_dir(format!("/proc/{process}/fd")).map_or(0, Iterator::count);
    1024 * kibibytes + SOCKET_BUFFER * (descriptors as u64).saturating_sub(FILES)
}

/// Bytes of a process; each page counts divided by the number of processes that share it.
fn proportional_memory(process: i32) -> u64 {
    let rollup = fs::read_to_string(format!("/proc/{process}/smaps_rollup"));
    match rollup.map(|rollup| sum_of(&rollup, &["Pss:"])) {
        // The file of an ended process is gone.
        Ok(kibibytes) => 1024 * kibibytes + extra_memory(process),
        Err(_) => Stat::of(process).map_or(0, |stat| stat.resident + extra_memory(process)),
    }
}

/// The number of mappings of a process. Stops after more than `enough`.
fn mappings(process: i32, enough: u64) -> u64 {
    let Ok(mut maps) = fs::File::open(format!("/proc/{process}/maps")) else { return 0 };
    let (mut buffer, mut count) = ([0; 1 << 16], 0);
    while let Ok(read @ 1..) = maps.read(&mut buffer) {
        count += buffer[..read].iter().filter(|byte| **byte == b'\n').count() as u64;
        if count > enough {
            break;
        }
    }
    count
}

/// Bytes that a process has written to disk, without those that it removed before they got there (`proc_pid_io(5)`).
fn written(process: i32) -> i64 {
    let counts = fs::read_to_string(format!("/proc/{process}/io")).unwrap_or_default();
    let [written, cancelled] =
        ["write_bytes:", "cancelled_write_bytes:"].map(|name| sum_of(&counts, &[name]));
    written.cast_signed() - cancelled.cast_signed()
}

/// The sum of the numbers on the lines that begin with these names.
fn sum_of(text: &str, names: &[&str]) -> u64 {
    let number = |line: &str| -> Option<u64> {
        let name = names.iter().find(|name| line.starts_with(**name))?;
        line[name.len()..].split_ascii_whitespace().next()?.parse().ok()
    };
    text.lines().filter_map(number).sum()
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::process::{Command, Stdio};

    use super::*;

    #[test]
    fn usage_includes_child_processes() {
        let mut child = Command::new("sleep").arg("60").stdout(Stdio::null()).spawn().unwrap();
        let own = std::process::id().cast_signed();
        let below = std::cell::RefCell::new(Vec::new());
        visit_descendants(own, 1000, |process| below.borrow_mut().push(process));
        let usage = Meter::default().measure(own, u64::MAX, u64::MAX);
        let exact = Meter::default().measure(own, u64::MAX, 0);
        let few = Meter::default().measure(own, 0, u64::MAX);
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(below.borrow().contains(&child.id().cast_signed()));
        assert!(few.threads < usage.threads);
        assert!(usage.threads >= 2 && usage.memory > 100_000, "{usage:?}");
        assert!(exact.memory > 100_000 && exact.memory <= 2 * usage.memory, "{exact:?} {usage:?}");
    }

    #[test]
    fn unnamed_files_are_those_of_descendants_without_a_name() {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&[1; 1 << 16]).unwrap();
        file.sync_all().unwrap();
        let own = std::process::id().cast_signed();
        let before = unnamed_files(own);
        let mut child = Command::new("sleep").arg("60").stdin(file).spawn().unwrap();
        let with_child = unnamed_files(own);
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(with_child >= before + (1 << 16), "{before} {with_child}");
    }

    #[test]
    fn usage_includes_ended_processes() {
        let mut meter = Meter::default();
        meter.seen.insert(i32::MAX, Seen { cpu: 3.0, written: 7 });
        let root = std::process::id().cast_signed();
        for _ in 0..2 {
            let usage = meter.measure(root, u64::MAX, u64::MAX);
            assert!(usage.cpu >= 3.0 && usage.written == 7, "{usage:?}");
        }
    }

    #[test]
    fn proc_fields_are_summed_by_name() {
        let text = "Name:\tx\nVmPTE:\t      40 kB\nVmSwap:\t 2 kB\nPss_Anon: 7 kB\n";
        assert_eq!(sum_of(text, &["VmPTE:", "VmSwap:"]), 42);
        assert_eq!(sum_of(text, &["Pss:"]), 0);
    }
}
