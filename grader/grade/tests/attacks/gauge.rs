//! Gauge of the machine's memory and disk during an attack.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Kinds of memory in `/proc/meminfo` that no process shows as its own, and that other programs hardly use.
const HIDDEN: [&str; 4] = ["Shmem:", "SUnreclaim:", "PageTables:", "KernelStack:"];

/// Most bytes of memory that an attack may take: its limits of memory and of files, and a margin for other programs.
const MOST_MEMORY: u64 = 256 << 20;

/// Most bytes of disk. Other programs write to it as well.
const MOST_DISK: u64 = 400 << 20;

const PAUSE: Duration = Duration::from_millis(5);

/// Watches the machine until it is asked.
#[derive(Debug)]
pub(crate) struct Gauge {
    done: Arc<AtomicBool>,
    watcher: JoinHandle<[u64; 2]>,
}

impl Gauge {
    /// Starts to watch the memory, and the disk of this folder.
    pub(crate) fn start(folder: PathBuf) -> Self {
        let done = Arc::new(AtomicBool::new(false));
        let is_done = Arc::clone(&done);
        let before = [memory(), disk(&folder)];
        let watcher = std::thread::spawn(move || {
            let mut most = [0; 2];
            while !is_done.load(Ordering::Relaxed) {
                let now = [memory(), disk(&folder)];
                for (most, (now, before)) in most.iter_mut().zip(now.into_iter().zip(before)) {
                    *most = (*most).max(now.saturating_sub(before));
                }
                std::thread::sleep(PAUSE);
            }
            most
        });
        Self { done, watcher }
    }

    /// Describes memory or disk used beyond the limits.
    pub(crate) fn breach(self) -> Option<String> {
        self.done.store(true, Ordering::Relaxed);
        let [memory, disk] = self.watcher.join().unwrap();
        let mebibytes = |bytes: u64| bytes >> 20;
        match () {
            () if memory > MOST_MEMORY => {
                Some(format!("breach: {} MiB of memory", mebibytes(memory)))
            }
            () if disk > MOST_DISK => Some(format!("breach: {} MiB of disk", mebibytes(disk))),
            () => None,
        }
    }
}

/// Bytes of memory of the hidden kinds, and of huge pages of which a part is mapped.
fn memory() -> u64 {
    let table = fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let kibibytes = |line: &str| -> Option<u64> {
        let rest = HIDDEN.iter().find_map(|name| line.strip_prefix(name))?;
        rest.split_ascii_whitespace().next()?.parse().ok()
    };
    let sizes = fs::read_dir("/sys/kernel/mm/transparent_hugepage").into_iter().flatten().flatten();
    let in_parts = |size: fs::DirEntry| -> Option<u64> {
        let name = size.file_name().into_string().ok()?;
        let kibibytes: u64 = name.strip_prefix("hugepages-")?.strip_suffix("kB")?.parse().ok()?;
        let count = fs::read_to_string(size.path().join("stats/nr_anon_partially_mapped")).ok()?;
        Some(kibibytes * count.trim().parse::<u64>().ok()?)
    };
    let shown = table.lines().filter_map(kibibytes).sum::<u64>();
    1024 * (shown + sizes.filter_map(in_parts).sum::<u64>())
}

/// Bytes in use on the disk of this folder.
fn disk(folder: &Path) -> u64 {
    let space = rustix::fs::statvfs(folder).unwrap();
    (space.f_blocks - space.f_bfree) * space.f_frsize
}
