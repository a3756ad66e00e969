//! Access to files, as Landlock rules (`landlock(7)`).
//!
//! Landlock controls opening, creating, removing and renaming files, TCP, and, from version 6 on, signals and abstract
//! sockets. It does not control modes, owners, times, extended attributes, locks or `stat`.

use std::path::{Path, PathBuf};

use ::landlock::{
    ABI, Access, AccessFs, AccessNet, LandlockStatus, Ruleset, RulesetAttr, RulesetCreatedAttr,
    RulesetError, RulesetStatus, Scope, path_beneath_rules,
};

/// The newest version whose file rights are used.
const FILES: ABI = ABI::V5;

/// The first version that controls truncation of files.
const FIRST_WITH_TRUNCATION: ABI = ABI::V3;

/// The first version that controls signals.
const FIRST_WITH_SIGNALS: ABI = ABI::V6;

/// The access that a thread keeps.
#[derive(Debug)]
pub(super) struct Reach<'a> {
    /// Files and folders to read and execute.
    pub(super) readable: Vec<&'a Path>,
    /// Devices to read and write.
    pub(super) devices: Vec<&'a Path>,
    /// Folders to write.
    pub(super) writable: Vec<PathBuf>,
}

/// The restrictions in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct InForce {
    /// No other file can be opened.
    pub(super) files: bool,
    /// Signals cannot reach processes outside.
    pub(super) signals: bool,
}

/// Restricts the calling thread and its children.
///
/// # Errors
/// If the kernel offers Landlock but refuses the rules.
pub(super) fn restrict(reach: &Reach<'_>) -> Result<InForce, RulesetError> {
    let all = AccessFs::from_all(FILES);
    let special =
        AccessFs::MakeChar | AccessFs::MakeBlock | AccessFs::MakeSock | AccessFs::MakeFifo;
    let read = AccessFs::from_read(FILES);
    let devices = AccessFs::ReadFile | AccessFs::WriteFile;
    let status = Ruleset::default()
        .handle_access(all)?
        .handle_access(AccessNet::from_all(ABI::V4))?
        .scope(Scope::from_all(FIRST_WITH_SIGNALS))?
        .create()?
        .add_rules(path_beneath_rules(&reach.readable, read))?
        .add_rules(path_beneath_rules(&reach.devices, devices))?
        .add_rules(path_beneath_rules(&reach.writable, all & !special))?
        .restrict_self()?;
    let version = match (status.ruleset, status.landlock) {
        (RulesetStatus::NotEnforced, _) => ABI::Unsupported,
        (_, LandlockStatus::Available { effective_abi, .. }) => effective_abi,
        _ => ABI::Unsupported,
    };
    Ok(InForce { files: version >= FIRST_WITH_TRUNCATION, signals: version >= FIRST_WITH_SIGNALS })
}
