//! What the processes of a run use, read off `/proc`.

use std::fs;

/// What a tree of processes uses by now.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Usage {
    /// Seconds of processor time, of ended and waited-for processes too.
    pub(super) cpu: f64,
    /// Bytes of memory.
    pub(super) memory: u64,
    /// Threads of all processes.
    pub(super) threads: u64,
}

/// What the process of this number and all below it use. A process that ends meanwhile may be missed. A tree
/// of more than `enough` threads is not followed to its end: it may grow faster than it is followed.
pub(super) fn of_tree(root: i32, enough: u64) -> Usage {
    let mut usage = Usage::default();
    let mut processes = vec![root];
    while let Some(process) = processes.pop() {
        usage.add(process);
        if usage.threads > enough {
            break;
        }
        children(process, &mut processes);
    }
    usage
}

/// Visits the processes below the process of this number, `most` of them where there are more.
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

fn children(process: i32, found: &mut Vec<i32>) {
    for thread in fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten() {
        let list = fs::read_to_string(thread.path().join("children")).unwrap_or_default();
        found.extend(list.split_ascii_whitespace().filter_map(|number| number.parse::<i32>().ok()));
    }
}

impl Usage {
    fn add(&mut self, process: i32) {
        let Ok(stat) = fs::read_to_string(format!("/proc/{process}/stat")) else { return };
        // The name in parentheses may hold anything; proc_pid_stat(5) counts from 1, and the name is 2.
        let Some((_, fields)) = stat.rsplit_once(") ") else { return };
        let fields: Vec<&str> = fields.split(' ').collect();
        let field = |number: usize| -> u64 {
            fields.get(number - 3).and_then(|text| text.parse().ok()).unwrap_or(0)
        };
        let ticks: u64 = (14..=17).map(field).sum();
        self.cpu += ticks as f64 / rustix::param::clock_ticks_per_second() as f64;
        self.threads += field(20);
        self.memory += field(24) * rustix::param::page_size() as u64;
    }
}

#[cfg(test)]
mod tests {
    use std::process::{Command, Stdio};

    use super::*;

    #[test]
    fn a_child_is_below_and_counts() {
        let mut child = Command::new("sleep").arg("60").stdout(Stdio::null()).spawn().unwrap();
        let own = std::process::id().cast_signed();
        let below = std::cell::RefCell::new(Vec::new());
        visit_descendants(own, 1000, |process| below.borrow_mut().push(process));
        let usage = of_tree(own, u64::MAX);
        let few = of_tree(own, 0);
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(below.borrow().contains(&child.id().cast_signed()));
        assert!(few.threads < usage.threads);
        assert!(usage.threads >= 2 && usage.memory > 100_000, "{usage:?}");
    }
}
