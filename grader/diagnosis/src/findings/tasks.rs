//! Findings from positions on each task of the hand-out on rounds of local and global steps.

use std::fmt;

use crate::change::Task;
use crate::change::rounds::is_of_rounds;
use scene::Scene;

use super::evidence::Marked;
use super::{Feature, Finding, FindingKind, is_unexplained};

/// The finding on a task.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskFinding {
    /// The task.
    pub task: Task,
    /// The verdict on it.
    pub verdict: TaskVerdict,
}

/// A verdict on a task, from positions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TaskVerdict {
    /// It is wrong: the proven mistakes in it.
    Wrong(Vec<String>),
    /// This mistake is proven, and one in another task makes the same positions.
    Ambiguous(Vec<String>),
    /// So many traces depend on it, and are right or right but for mistakes in other tasks; so many others are wrong without
    /// a known cause.
    Consistent {
        /// The former.
        scenes: usize,
        /// The latter.
        unexplained: usize,
    },
    /// No trace that is right or explained depends on it; so many are wrong without a known cause.
    Unknown {
        /// The latter.
        unexplained: usize,
    },
}

impl TaskVerdict {
    /// The machine-readable name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Wrong(_) => "wrong",
            Self::Ambiguous(_) => "ambiguous",
            Self::Consistent { .. } => "consistent",
            Self::Unknown { .. } => "unknown",
        }
    }
}

impl fmt::Display for TaskVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scenes = |count: usize| match count {
            1 => "1 scene".to_owned(),
            count => format!("{count} scenes"),
        };
        let wrong = |count: usize| match count {
            1 => "1 wrong scene shows no cause".to_owned(),
            count => format!("{count} wrong scenes show no cause"),
        };
        match self {
            Self::Wrong(words) => write!(f, "wrong: {}", words.join("; ")),
            Self::Ambiguous(words) => {
                write!(f, "cannot be told from positions: {}", words.join("; "))
            }
            Self::Consistent { scenes: count, unexplained: 0 } => {
                write!(f, "consistent with the traces of {}", scenes(*count))
            }
            Self::Consistent { scenes: count, unexplained } => {
                let traces = scenes(*count);
                write!(f, "consistent with the traces of {traces}; {}", wrong(*unexplained))
            }
            Self::Unknown { unexplained: 0 } => {
                f.write_str("cannot be told from positions: no right trace depends on it")
            }
            Self::Unknown { unexplained } => {
                write!(f, "cannot be told from positions: {}", wrong(*unexplained))
            }
        }
    }
}

/// The tasks, where all scenes are made by rounds; otherwise empty.
pub(super) fn of(scenes: &[Marked<'_>], list: &[Finding]) -> Vec<TaskFinding> {
    let of_scenes = scenes.iter().map(|scene| Judged {
        scene: scene.judged.scene,
        is_right: scene.passed || scene.explained && scene.is_suspect(),
        is_unexplained: is_unexplained(scene),
    });
    judged(&of_scenes.collect::<Vec<_>>(), list)
}

/// The same of scenes that all pass.
pub fn of_passed<'a>(scenes: impl Iterator<Item = &'a Scene>) -> Vec<TaskFinding> {
    let of = |scene| Judged { scene, is_right: true, is_unexplained: false };
    judged(&scenes.map(of).collect::<Vec<_>>(), &[])
}

struct Judged<'a> {
    scene: &'a Scene,
    /// Right, or right but for the mistakes that are proven.
    is_right: bool,
    is_unexplained: bool,
}

fn judged(scenes: &[Judged<'_>], list: &[Finding]) -> Vec<TaskFinding> {
    if scenes.is_empty() || !scenes.iter().all(|judged| is_of_rounds(judged.scene)) {
        return Vec::new();
    }
    let verdict = |task: Task| {
        let is_of = |feature: &Feature| *feature == Feature::Task(task);
        let causes = list.iter().filter(|finding| {
            finding.kind == FindingKind::Cause && finding.features.iter().any(is_of)
        });
        let (sure, open): (Vec<&Finding>, Vec<&Finding>) =
            causes.partition(|finding| finding.features.iter().all(is_of));
        let words = |list: &[&Finding]| list.iter().map(|finding| finding.sentence()).collect();
        if !sure.is_empty() {
            let words: Vec<String> = words(&sure);
            let own = format!("{task}: ");
            return TaskVerdict::Wrong(words.iter().map(|words| words.replace(&own, "")).collect());
        }
        if !open.is_empty() {
            return TaskVerdict::Ambiguous(words(&open));
        }
        let depend = || scenes.iter().filter(|judged| task.is_in(judged.scene));
        let unexplained = depend().filter(|judged| judged.is_unexplained).count();
        match depend().filter(|judged| judged.is_right).count() {
            0 => TaskVerdict::Unknown { unexplained },
            scenes => TaskVerdict::Consistent { scenes, unexplained },
        }
    };
    Task::ALL.into_iter().map(|task| TaskFinding { task, verdict: verdict(task) }).collect()
}
