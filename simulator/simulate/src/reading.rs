//! How a scene is read, which may be somebody else's: confined to its folder, and of limited size where it is drawn.

use clap::Args;
use scene::{Overrides, ParseOptions, SceneLimits};
use simulator::generate::parse_option;

/// Sizes of scenes that are drawn, unless others are given.
pub(crate) const DRAWN: SceneLimits =
    SceneLimits { bytes: 64 << 20, particles: 100_000, forces: 1_000_000 };

/// Options of reading a scene.
#[derive(Args)]
pub(crate) struct Reading {
    /// Unknown elements and attributes of the scene are errors, not warnings
    #[arg(long)]
    strict: bool,

    /// Also read meshes, material libraries and pictures outside the scene's folder, of a scene that you trust
    #[arg(long)]
    unconfined: bool,

    /// Set a limit of the scene, as in --limit particles=500000 (repeatable). Limits, by default only for pictures, diagrams and
    /// the live page: bytes of each file (64 MiB), particles (100,000), forces (1,000,000)
    #[arg(long = "limit", value_name = "NAME=NUMBER", value_parser = parse_limit)]
    limits: Vec<(String, u64)>,
}

impl Reading {
    /// The options with these values and, where no others are given, these limits.
    pub(crate) fn options(&self, overrides: Overrides, mut limits: SceneLimits) -> ParseOptions {
        for (name, number) in &self.limits {
            limits.named(name).into_iter().for_each(|limit| *limit = *number);
        }
        ParseOptions { strict: self.strict, overrides, confined: !self.unconfined, limits }
    }
}

fn parse_limit(text: &str) -> Result<(String, u64), String> {
    let (name, number) = parse_option(text)?;
    let limits = SceneLimits::NAMES.join(", ");
    let limit = SceneLimits::default().named(&name).is_some().then_some(number);
    let number = limit.ok_or_else(|| format!("the limits are {limits}"))?;
    let number = number.parse().map_err(|_| format!("{number:?} is not a whole number"))?;
    Ok((name, number))
}
