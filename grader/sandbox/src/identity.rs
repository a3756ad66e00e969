//! An unprivileged user of its own for each run that root starts, and no capabilities for any.

use std::io;
use std::os::unix::fs::MetadataExt;

use rustix::fs::{Gid, Mode, Uid};
use rustix::process::{Pid, Signal, kill_process_group};
use rustix::thread::{
    CapabilitySet, CapabilitySets, clear_ambient_capability_set, set_capabilities,
    set_thread_groups, set_thread_res_gid, set_thread_res_uid,
};

use super::tree::{self, Owner};
use super::{Job, scratch};

/// The first of a range of user IDs that no system gives to people, services or containers; the last bits are those
/// of a process of the run.
const FIRST: u32 = 0x7000_0000;

/// Process numbers have at most so many bits.
const BITS: u32 = 22;

/// The group of all such users.
const GROUP: u32 = FIRST - 1;

/// The user and group that take the place of these where a container maps only the lower ones.
const NOBODY: u32 = 65534;

/// A user and group by their numbers.
pub(super) fn owner((user, group): (u32, u32)) -> Owner {
    (Uid::from_raw(user), Gid::from_raw(group))
}

/// The user and group of the run that this process serves.
pub(super) fn own() -> Owner {
    let number = FIRST + (std::process::id() & ((1 << BITS) - 1));
    if maps("/proc/self/uid_map", number) && maps("/proc/self/gid_map", GROUP) {
        (Uid::from_raw(number), Gid::from_raw(GROUP))
    } else {
        (Uid::from_raw(NOBODY), Gid::from_raw(NOBODY))
    }
}

/// Whether this process's user namespace has this user or group.
fn maps(file: &str, number: u32) -> bool {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    text.lines().any(|line| {
        let numbers: Vec<u32> =
            line.split_ascii_whitespace().filter_map(|word| word.parse().ok()).collect();
        matches!(numbers[..], [first, _, count] if number >= first && number - first < count)
    })
}

/// Makes the calling thread, and what it starts, that user, without any capability.
pub(super) fn become_unprivileged(owner: Option<Owner>) -> io::Result<()> {
    if let Some((user, group)) = owner {
        set_thread_groups(&[])?;
        set_thread_res_gid(group, group, group)?;
        set_thread_res_uid(user, user, user)?;
    }
    // Kernels before 4.3 have none.
    let _ = clear_ambient_capability_set();
    let none = CapabilitySet::empty();
    set_capabilities(None, CapabilitySets { effective: none, permitted: none, inheritable: none })?;
    Ok(())
}

/// Gives the folder of a run to its user, and lets its group through the scratch folders above that and above what
/// it may read. Without a root of its own, it meets them where they are.
pub(super) fn hand_over(job: &Job, owner: Owner) -> io::Result<()> {
    tree::give(&job.folder, owner)?;
    let paths = job.readable.iter().chain([&job.folder]);
    for folder in paths.flat_map(|path| path.ancestors()).filter(|path| scratch::is_scratch(path)) {
        if std::fs::symlink_metadata(folder)?.uid() == 0 {
            rustix::fs::chown(folder, None, Some(owner.1))?;
            rustix::fs::chmod(folder, Mode::RWXU | Mode::XGRP)?;
        }
    }
    Ok(())
}

/// Kills every process of the user.
pub(super) fn kill_all(owner: Owner) {
    // A thread of that user can signal its processes and no others.
    let killer = std::thread::Builder::new().spawn(move || {
        become_unprivileged(Some(owner)).is_ok().then(|| {
            // All that it may signal; there may be none.
            kill_process_group(Pid::INIT, Signal::KILL)
        })
    });
    let _ = killer.map(std::thread::JoinHandle::join);
}
