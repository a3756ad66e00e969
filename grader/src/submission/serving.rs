//! Many scenes in one run of a program.
//!
//! ```text
//! PROGRAM --serve      standard input: one line for each scene, `SCENE TRACE`
//! ```
//!
//! Each line holds the two files of a call. The program writes each trace before it turns to the next line, and may end at a
//! scene that it does not simulate. The start of a program takes longer than a small scene.
//!
//! A scene without a trace is run again alone, to learn why it has none. If the exit status of a run is not 0, its last
//! scene is run again too. The caller runs the program on each scene by itself before it calls it wrong: a program may keep
//! something from one scene to the next.

use std::fmt::Write;
use std::fs;
use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

use scene::trace::{self, Shape};

use super::program::{
    CALLS, CommandLine, GREETED, Program, ProgramRun, Serving, Workspace, extension, greeted,
    greetings,
};
use sandbox::{End, Job, Keep, SandboxError};

/// The argument by which a program serves.
const SERVE: &str = "--serve";

/// The most scenes of a run: with their traces and their list, fewer than the files that a run may have.
pub const MOST: usize = 16;

/// Traces of a run from which another one serves the scenes behind the one that ended it.
const WORTH: usize = 2;

/// Runs that exceed a limit, after which a program no longer serves.
const PATIENCE: u32 = 3;

impl Program {
    /// The same program, with `PROGRAM --serve` if it has no such command and serves the minimal scene by this one. Cost: up to
    /// four runs.
    ///
    /// # Errors
    /// If the grader or its machine could not run it.
    pub fn asked_to_serve(mut self) -> Result<Self, SandboxError> {
        if self.serving.is_some() || !self.is_called_as_usual() {
            return Ok(self);
        }
        let (program, arguments) = (self.path.clone(), vec![SERVE.to_owned()]);
        let offered = Serving::new(CommandLine { program, arguments });
        for scene in greetings() {
            let (_, runs) = self.serve_run(&offered, &[(scene.as_str(), GREETED); 2])?;
            if runs.into_iter().all(|run| run.is_some_and(|run| greeted(run).is_ok())) {
                self.serving = Some(Arc::new(offered));
                break;
            }
        }
        Ok(self)
    }

    /// Whether it serves.
    pub fn serves(&self) -> bool {
        self.serving.as_ref().is_some_and(|serving| serving.exceeded.load(Relaxed) < PATIENCE)
    }

    /// The runs of several scenes, if it serves: `None` for each scene of which it leaves no trace.
    ///
    /// # Errors
    /// If the grader or its machine could not run it.
    pub fn serve(&self, scenes: &[(&str, Shape)]) -> Result<Vec<Option<ProgramRun>>, SandboxError> {
        let mut all: Vec<Option<ProgramRun>> = Vec::new();
        if let Some(serving) = &self.serving {
            while self.serves() && scenes.len() - all.len() >= WORTH {
                let rest = &scenes[all.len()..];
                let (end, mut runs) = self.serve_run(serving, &rest[..rest.len().min(MOST)])?;
                if matches!(end, End::Exceeded(_)) {
                    serving.exceeded.fetch_add(1, Relaxed);
                }
                if end != End::Exited(0) {
                    // The scene of the last trace ended the run, or the one behind it.
                    let last = runs.iter().rposition(Option::is_some);
                    runs.truncate(last.map_or(0, |last| last + 2));
                    runs.iter_mut().skip(last.unwrap_or_default()).for_each(|run| *run = None);
                }
                let count = runs.iter().flatten().count();
                all.extend(runs);
                if count < WORTH {
                    break;
                }
            }
        }
        all.resize_with(scenes.len(), || None);
        Ok(all)
    }

    /// One run on several scenes: its end, and the run of each scene.
    fn serve_run(
        &self,
        serving: &Serving,
        scenes: &[(&str, Shape)],
    ) -> Result<(End, Vec<Option<ProgramRun>>), SandboxError> {
        let workspace = Workspace::empty(&self.runner).map_err(SandboxError::no_scratch)?;
        let (folder, kept) = (workspace.folder(), workspace.trace());
        let names: Vec<String> = (0..scenes.len())
            .map(|number| format!("{number}.{}", extension(self.format)))
            .collect();
        let prepare = || -> io::Result<()> {
            fs::create_dir(&folder)?;
            fs::create_dir(&kept)?;
            let mut calls = String::new();
            for (number, ((text, _), name)) in scenes.iter().zip(&names).enumerate() {
                fs::write(folder.join(format!("{number}.xml")), text)?;
                let _ = writeln!(calls, "{number}.xml {name}");
            }
            fs::write(folder.join(CALLS), calls)
        };
        prepare().map_err(SandboxError::no_scratch)?;
        let job = Job {
            program: serving.program.clone(),
            arguments: serving.arguments.iter().map(Into::into).collect(),
            folder,
            input: Some(CALLS.to_owned()),
            keep: Keep::Each(names.clone(), kept.clone()),
            readable: self.runner.readable.clone(),
            limits: self.runner.limits,
        };
        let outcome = self.runner.sandbox.run(&job)?;
        let workspace = Arc::new(workspace);
        let run = |(name, (_, shape)): (&String, &(&str, Shape))| {
            let path = kept.join(name);
            // A file without content was opened and not written.
            path.metadata().ok().filter(|metadata| metadata.len() > 0)?;
            let reader = trace::open(&path, self.format, *shape).ok()?;
            let (workspace, _copy) = (Arc::clone(&workspace), self.copy.clone());
            Some(ProgramRun { reader, workspace, _copy })
        };
        Ok((outcome.end, names.iter().zip(scenes).map(run).collect()))
    }
}
