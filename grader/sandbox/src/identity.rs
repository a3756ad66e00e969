//! Unprivileged user of a run: a separate user ID if root starts it, and no capabilities in any case.

use std::collections::HashSet;
use std::fs;
use std::io;
use std::os::fd::AsFd;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::{SocketAddr, UnixListener};
use std::time::Instant;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Gid, Mode, Uid};
use rustix::process::{Pid, Signal, kill_process_group};
use rustix::thread::{
    CapabilitySet, CapabilitySets, clear_ambient_capability_set, set_capabilities,
    set_thread_groups, set_thread_res_gid, set_thread_res_uid,
};

use super::tree::{self, Owner};
use super::{Job, Limits, scratch};

/// First of a range of user IDs that systems assign to no person, service or container. The low bits are the number of
/// a process of the run.
const FIRST_USER: u32 = 0x7000_0000;

/// Maximum number of bits of a process number.
const PROCESS_BITS: u32 = 22;

/// The group of all such users.
const GROUP: u32 = FIRST_USER - 1;

/// Number of IDs tried, from the highest down, if a container maps only low ones.
const TRIED: usize = 256;

/// Pause while other runs have all IDs.
const PAUSE: Timespec = Timespec { tv_sec: 0, tv_nsec: 5_000_000 };

/// Runs that a run waits for, each as long as it may take itself.
const TURNS: f64 = 20.0;

/// User of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct User {
    pub(super) owner: Owner,
    /// Whether every process of this user belongs to the run.
    pub(super) is_exclusive: bool,
}

/// A user that no other run has until this is dropped.
#[derive(Debug)]
pub(super) struct Claim {
    pub(super) user: User,
    /// A socket with the user's name: the kernel gives a name to one process, until that ends.
    _name: Option<UnixListener>,
}

impl Claim {
    /// The user and group of the run that this process serves. Waits while other runs have all IDs that a container maps.
    ///
    /// # Errors
    /// If only root is mapped, the grader ends meanwhile, or no ID becomes free.
    pub(super) fn new(grader: impl AsFd, limits: &Limits) -> io::Result<Self> {
        let [users, groups] =
            ["uid_map", "gid_map"].map(|map| mapped(&read(&format!("/proc/self/{map}"))));
        let maps = |ranges: &[(u32, u32)], number: u32| {
            ranges.iter().any(|(first, last)| (*first..=*last).contains(&number))
        };
        let own = FIRST_USER + (std::process::id() & ((1 << PROCESS_BITS) - 1));
        if maps(&users, own) && maps(&groups, GROUP) {
            let owner = (Uid::from_raw(own), Gid::from_raw(GROUP));
            return Ok(Self { user: User { owner, is_exclusive: true }, _name: None });
        }
        let none = || io::Error::other("this container maps no user and group but root");
        let group = Gid::from_raw(highest(&groups).next().ok_or_else(none)?);
        let accounts = accounts(&read("/etc/passwd"));
        let (named, mut free): (Vec<u32>, Vec<u32>) =
            highest(&users).take(TRIED).partition(|number| accounts.contains(number));
        free.extend(named);
        if free.is_empty() {
            return Err(none());
        }
        Self::one_of(&free, group, grader, TURNS * limits.wall)
    }

    /// One of these users, as soon as another run leaves it, within so many seconds.
    fn one_of(free: &[u32], group: Gid, grader: impl AsFd, longest: f64) -> io::Result<Self> {
        let started = Instant::now();
        loop {
            let busy = users_of_processes();
            // An ID that other processes also have is the last choice: it does not distinguish them from the run.
            let mut shared = None;
            for number in free {
                let name = SocketAddr::from_abstract_name(format!("{}{number}", scratch::PREFIX))?;
                let Ok(name) = UnixListener::bind_addr(&name) else { continue };
                let is_exclusive = !busy.contains(number);
                let owner = (Uid::from_raw(*number), group);
                let claim = Self { user: User { owner, is_exclusive }, _name: Some(name) };
                if is_exclusive {
                    return Ok(claim);
                }
                shared.get_or_insert(claim);
            }
            if let Some(claim) = shared {
                return Ok(claim);
            }
            if started.elapsed().as_secs_f64() > longest {
                let message = format!(
                    "for {longest} s, other runs had every user ID that this container maps\n  help: end other graders, \
                     or map more IDs (--uidmap)"
                );
                return Err(io::Error::other(message));
            }
            if poll(&mut [PollFd::new(&grader, PollFlags::empty())], Some(&PAUSE))? > 0 {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
        }
    }
}

impl User {
    /// Kills every process of this user, if all belong to the run.
    pub(super) fn kill_all(self) {
        if !self.is_exclusive {
            return;
        }
        // A thread of that user can signal only that user's processes.
        let killer = std::thread::Builder::new().spawn(move || {
            become_unprivileged(Some(self.owner)).is_ok().then(|| {
                // All processes that it may signal, if any.
                kill_process_group(Pid::INIT, Signal::KILL)
            })
        });
        let _ = killer.map(std::thread::JoinHandle::join);
    }
}

fn read(file: &str) -> String {
    fs::read_to_string(file).unwrap_or_default()
}

/// The ranges of IDs that a user namespace has (`user_namespaces(7)`), as their first and last number.
fn mapped(map: &str) -> Vec<(u32, u32)> {
    let range = |line: &str| {
        let mut numbers = line.split_ascii_whitespace().map(str::parse::<u32>);
        let (first, _, count) = (numbers.next()?.ok()?, numbers.next()?, numbers.next()?.ok()?);
        Some((first, first.saturating_add(count.checked_sub(1)?)))
    };
    map.lines().filter_map(range).collect()
}

/// The IDs of these ranges from the highest down, without root's.
fn highest(ranges: &[(u32, u32)]) -> impl Iterator<Item = u32> {
    let mut ranges = ranges.to_vec();
    ranges.sort_unstable_by(|a, b| b.cmp(a));
    ranges.into_iter().flat_map(|(first, last)| (first.max(1)..=last).rev())
}

/// The IDs of the users that `passwd(5)` names.
fn accounts(passwd: &str) -> HashSet<u32> {
    passwd.lines().filter_map(|line| line.split(':').nth(2)?.parse().ok()).collect()
}

/// The users who have processes.
fn users_of_processes() -> HashSet<u32> {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    entries.filter_map(|process| process.metadata().ok()).map(|process| process.uid()).collect()
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
        if fs::symlink_metadata(folder)?.uid() == 0 {
            rustix::fs::chown(folder, None, Some(owner.1))?;
            rustix::fs::chmod(folder, Mode::RWXU | Mode::XGRP)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_waits_for_its_user_until_a_limit_or_the_end_of_the_grader() {
        let (grader, other_end) = std::os::unix::net::UnixStream::pair().unwrap();
        // No process has it.
        let free = [FIRST_USER - 2];
        let claim = |longest| Claim::one_of(&free, Gid::from_raw(GROUP), &grader, longest);
        let first = claim(0.0).unwrap();
        assert!(first.user.is_exclusive);
        let error = claim(0.01).unwrap_err().to_string();
        assert!(error.starts_with("for 0.01 s, other runs had every user ID"), "{error}");
        drop(other_end);
        assert_eq!(claim(1e6).unwrap_err().kind(), io::ErrorKind::BrokenPipe);
        drop(first);
        assert!(claim(0.0).is_ok());
    }

    #[test]
    fn a_run_gets_the_highest_mapped_ids_but_never_root() {
        let of = |map: &str| highest(&mapped(map)).take(3).collect::<Vec<u32>>();
        assert_eq!(of("0 1000 1\n65534 100000 1\n"), [65534]);
        assert_eq!(
            of("         0       1000          1\n         1     100000          3\n"),
            [3, 2, 1]
        );
        assert_eq!(of("0 0 4294967295\n"), [u32::MAX - 1, u32::MAX - 2, u32::MAX - 3]);
        assert_eq!(of("0 1000 1\n"), [0_u32; 0]);
        assert!(accounts("nobody:x:65534:65534::/:\n").contains(&65534));
    }
}
