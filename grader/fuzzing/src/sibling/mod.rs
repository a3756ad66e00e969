//! Siblings of scenes: the same features with other numbers, drawn by a seed. They serve as hidden scenes.
//!
//! ```text
//! draw::redraw    scene -> scene       positions turned, scaled, moved and nudged; velocities, masses, parameters, time
//!                                      step and number of steps times a factor; particles, edges and forces permuted
//! files::Files    scene -> files       in the original's order of elements, with its spelling of the integrator
//! Reference       scene -> states      whether the sibling is as well-posed as the original
//! ```
//!
//! The structure of a scene decides its test, and stays: the elements, who is joined to whom, what is zero or left out,
//! which values are equal to each other, and options. Turning all vectors and scaling all lengths preserves the motion
//! of every force that does not depend on place or direction; all other changes are factors near 1. Whether the
//! sibling catches the mistakes that the original catches is for the caller to check: the mistakes are in another crate.

mod draw;
mod files;
mod reference;

use std::io;

use grader::suite::Case;
use scene::Scene;

pub use grader::oracle::folder::Files;
pub use reference::Reference;

use crate::choices::Choices;

/// A drawn scene: its files, and the scene that they hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// The files.
    pub files: Files,
    /// The scene, as it is read from them.
    pub scene: Scene,
}

/// Why a drawn scene is no sibling.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Fault {
    /// A file of the original cannot be read, or the sibling's cannot be written or read.
    #[error("its files cannot be used: {0}")]
    Files(String),
    /// It has a special value.
    #[error("{0}")]
    Special(String),
    /// Two particles are closer together than in the original.
    #[error("two particles are too close to each other")]
    Close,
    /// A step fails.
    #[error("{0}")]
    Fails(String),
    /// Its motion follows the time step.
    #[error("it blows up")]
    BlowsUp,
    /// Equally correct programs differ too much.
    #[error("equally correct programs differ too much")]
    Chaotic,
    /// A mistake that the original catches passes.
    #[error("a mistake passes that the original catches: {0}")]
    Escapes(String),
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Self::Files(error.to_string())
    }
}

/// Draws a scene. `spread`, from 0 to 1, scales how far numbers depart from the original's.
///
/// # Errors
/// If the files of the original or of the drawn scene cannot be used.
pub fn draw(case: &Case, spread: f64, choices: &mut Choices) -> Result<Drawn, Fault> {
    let files = files::draw(case, spread, choices)?;
    let scene = files::read(&files)?;
    Ok(Drawn { files, scene })
}

#[cfg(test)]
mod tests;
