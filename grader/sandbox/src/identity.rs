//! Unprivileged user of a run: a unique user ID if root starts it, and no capabilities in any case.

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

/// First of a range of user IDs that systems assign to no person, service or container. The low bits are the number of
/// a process of the run.
const FIRST_USER: u32 = 0x7000_0000;

/// Maximum number of bits of a process number.
const PROCESS_BITS: u32 = 22;

/// The group of all such users.
const GROUP: u32 = FIRST_USER - 1;

/// User and group to use instead if a container maps only low IDs.
const NOBODY: u32 = 65534;

/// The user and group of the run that this process serves.
pub(super) fn own() -> Owner {
    let number = FIRST_USER + (std::process::id() & ((1 << PROCESS_BITS) - 1));
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

/// Switches the calling thread and its children to this user, without any capability.
pub(super) fn become_unprivileged(owner: Option<Owner>) -> io::Result<()> {
    if let Some((user, group)) = owner {
        set_thread_groups(&[])?;
        set_thread_res_gid(group, group, group)?;
        set_thread_res_uid(user, user, user)?;
    }
    // Kernels before 4.3 have no ambient capabilities.
    let _ = clear_ambient_capability_set();
    let none = CapabilitySet::empty();
    set_capabilities(None, CapabilitySets { effective: none, permitted: none, inheritable: none })?;
    Ok(())
}

/// Gives the folder of a run to its user, and lets its group enter the scratch folders above it and above the readable
/// paths. Needed without a separate root, where the program uses these paths in place.
pub(super) fn hand_over(job: &Job, owner: Owner) -> io::Result<()> {
    tree::change_owner(&job.folder, owner)?;
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
    // A thread of that user can signal only that user's processes.
    let killer = std::thread::Builder::new().spawn(move || {
        become_unprivileged(Some(owner)).is_ok().then(|| {
            // All processes that it may signal, if any.
            kill_process_group(Pid::INIT, Signal::KILL)
        })
    });
    let _ = killer.map(std::thread::JoinHandle::join);
}
