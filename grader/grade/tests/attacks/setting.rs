//! Settings of attacks: users, and kernels with fewer features.

use std::path::Path;
use std::process::Command;

/// The user that starts the grader, and the kernel's features.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Setting {
    /// An ordinary user.
    User,
    /// The superuser with all capabilities.
    Root,
    /// An ordinary user without user namespaces.
    UserWithoutNamespaces,
    /// The superuser with only the capabilities of containers, without user namespaces.
    Container,
    /// An ordinary user, and a kernel without Landlock.
    UserWithoutLandlock,
    /// The superuser, and a kernel without Landlock.
    RootWithoutLandlock,
    /// The root of a container that an ordinary user started: it has two user IDs, root's and 65534.
    RootlessContainer,
}

impl Setting {
    /// Its name in the document.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::User => "user",
            Self::Root => "root",
            Self::UserWithoutNamespaces => "user without user namespaces",
            Self::Container => "root in a container",
            Self::UserWithoutLandlock => "user without Landlock",
            Self::RootWithoutLandlock => "root without Landlock",
            Self::RootlessContainer => "root in a rootless container",
        }
    }

    /// Whether the grader runs as the superuser.
    fn is_root(self) -> bool {
        matches!(self, Self::Root | Self::Container | Self::RootWithoutLandlock)
    }

    /// The user of the grader, if not this process's. Each setting and each test process has a different one, so that
    /// processes left running are found. The next one is a container's 65534.
    pub(crate) fn user(self) -> Option<u32> {
        let first = 1_000_000 + 8 * (std::process::id() % 100_000);
        (is_superuser() && !self.is_root()).then_some(first + self as u32)
    }

    /// The command that starts another command in this setting, through the launcher.
    pub(crate) fn command(self, launcher: &Path) -> Command {
        let mut command = Command::new(launcher);
        match self {
            Self::User | Self::Root => {}
            Self::UserWithoutNamespaces => drop(command.arg("--no-user-namespaces")),
            Self::Container => {
                command.args(["--no-user-namespaces", "--no-admin", "--no-groups"]);
            }
            Self::RootlessContainer => {
                command.args(["--no-user-namespaces", "--no-admin", "--no-groups", "--rootless"]);
            }
            Self::UserWithoutLandlock | Self::RootWithoutLandlock => {
                command.arg("--no-landlock");
            }
        }
        if let Some(user) = self.user() {
            if self != Self::RootlessContainer {
                command.arg("--user");
            }
            command.arg(user.to_string());
        }
        command.arg("--");
        command
    }
}

/// Whether this process runs as the superuser.
pub(crate) fn is_superuser() -> bool {
    rustix::process::geteuid().is_root()
}
