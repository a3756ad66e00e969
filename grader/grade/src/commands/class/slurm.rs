//! Jobs of a plan on a Slurm cluster: arrays with one job for each shard, and a job that merges when all have ended.
//!
//! The name of the jobs is a hash of the folder of the results. Slurm therefore knows which jobs belong to which
//! results, and nothing is lost if `grade` is killed while it submits. Whether a submission is graded is read from its
//! result, not from the state of a job.

use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use grader::class::plan::Plan;
use grader::suite::hash_bytes;
use serde_json::Value;

use grader::grading::events::Observer;

use super::setting::Class;
use super::{Phase, real};
use crate::output::create_folder;
use crate::stop::{Exit, Stop, complain};

/// Folder of the jobs' output in the folder of the results.
const LOGS: &str = "slurm";

/// Pause between two looks at the jobs.
const PAUSE: Duration = Duration::from_secs(5);

/// Interval at which an interrupt is noticed.
const TICK: Duration = Duration::from_millis(100);

/// Time for which results may stay invisible on a shared file system after their job: the default of NFS for folders.
const LATE: Duration = Duration::from_secs(30);

/// States of jobs that have ended.
const ENDED: [&str; 9] = [
    "BOOT_FAIL",
    "CANCELLED",
    "COMPLETED",
    "DEADLINE",
    "FAILED",
    "NODE_FAIL",
    "OUT_OF_MEMORY",
    "PREEMPTED",
    "TIMEOUT",
];

/// Reasons for which a job waits in the normal course of events.
const USUAL: [&str; 8] = [
    "None",
    "Priority",
    "Resources",
    "Dependency",
    "JobArrayTaskLimit",
    "BeginTime",
    "QOSMaxCpuPerUserLimit",
    "QOSMaxJobsPerUserLimit",
];

/// A job that has not ended.
struct Job {
    is_running: bool,
    /// Why it waits, if it does and the reason is unusual.
    reason: Option<String>,
}

/// The largest number of jobs in an array.
///
/// # Errors
/// If there is no Slurm, or jobs for these results have not ended.
pub(super) fn ready(output: &Path) -> Result<u32, Stop> {
    let config = call(Command::new("scontrol").args(["show", "config"]))?;
    let size = config.lines().find_map(|line| {
        let (key, value) = line.split_once('=')?;
        (key.trim() == "MaxArraySize").then(|| value.trim().parse().ok())?
    });
    // If the folder does not exist yet, there are no jobs.
    let active = if output.exists() { active(output)?.len() } else { 0 };
    if active > 0 {
        return Err(Stop::bad_input(format!(
            "{}: jobs for these results have not ended\n  help: --attach shows their progress, --cancel ends them",
            output.display()
        )));
    }
    Ok(size.unwrap_or(1))
}

/// Submits the shards, in arrays of at most `most` jobs, and the merge.
pub(super) fn submit(class: &Class<'_>, plan: &Plan, path: &Path, most: u32) -> Result<(), Stop> {
    let output = &class.output;
    let logs = create_folder(&real(output)?, LOGS).map_err(Stop::about(&output.join(LOGS)))?;
    let grade = std::env::current_exe().map_err(Stop::fault)?;
    let [grade, plan_file] = [quoted(&grade)?, quoted(path)?];
    let at_once = class.args.plan.at_once.map_or_else(String::new, |count| format!("%{count}"));
    let name = format!("--job-name={}", job_name(output)?);
    let job = |log: &str, options: &[&str], command: &str| {
        let log = format!("--output={}/{log}", logs.display());
        let mut sbatch = Command::new("sbatch");
        sbatch.args(["--parsable", "--requeue", "--open-mode=append", &name, &log]);
        sbatch.args(options).args(&class.args.plan.sbatch).args(["--wrap", command]);
        call(&mut sbatch)
    };
    let shards: Vec<usize> = (0..plan.shards.len()).collect();
    let mut dependency: Option<String> = None;
    for phase in class.phases() {
        let option = if *phase == Phase::Hidden { " --hidden-scenes" } else { "" };
        let mut ids = "--dependency=afterany".to_owned();
        for part in shards.chunks(most.max(1) as usize) {
            let array = format!("--array=0-{}{at_once}", part.len() - 1);
            let shard = format!("\"$(({} + SLURM_ARRAY_TASK_ID))\"", part[0]);
            let threads = "--threads \"${SLURM_CPUS_ON_NODE:-1}\"";
            let command =
                format!("exec {grade} class run-shard {plan_file} {shard}{option} {threads}");
            let options: Vec<&str> = [&*array].into_iter().chain(dependency.as_deref()).collect();
            let id = job("%A_%a.txt", &options, &command)?;
            // On a cluster of several, its name follows.
            let id = id.trim().split(';').next().unwrap_or_default();
            ids += &format!(":{id}");
        }
        dependency = Some(ids);
    }
    let dependency = dependency.unwrap_or_default();
    job("merge.txt", &[&dependency], &format!("exec {grade} class merge {plan_file}"))?;
    complain(
        "note",
        format!(
            "{} jobs submitted; Ctrl-C leaves them running, --attach comes back, --cancel ends them",
            shards.len() * class.phases().len()
        ),
    );
    Ok(())
}

/// Shows the progress of the jobs until they have ended, then the summary.
///
/// # Errors
/// If it is interrupted, Slurm does not answer, or the summary cannot be written.
pub(super) fn follow(class: &Class<'_>, plan: &Plan) -> Result<Exit, Stop> {
    let output = &class.output;
    let total = plan.submissions.len();
    let mut missing: Vec<usize> = (0..total).collect();
    let mut ended: Option<Instant> = None;
    loop {
        let start = Instant::now();
        let jobs = active(output)?;
        missing.retain(|place| class.record(plan, &plan.submissions[*place]).is_none());
        let reasons = jobs.iter().find_map(|job| job.reason.as_deref());
        let reason = reasons.map_or_else(String::new, |reason| format!("; jobs wait: {reason}"));
        let running = jobs.iter().filter(|job| job.is_running).count();
        class.progress.show(&format!(
            "{}/{total} submissions, {running} jobs running{reason}",
            total - missing.len()
        ));
        if jobs.is_empty() {
            let since = *ended.get_or_insert_with(Instant::now);
            if missing.is_empty() || since.elapsed() >= LATE {
                return class.merge(plan);
            }
        } else {
            ended = None;
        }
        // Looking costs the file system a question for each missing result.
        let end = Instant::now() + PAUSE.max(20 * start.elapsed());
        while Instant::now() < end {
            if class.progress.is_stopped() {
                return Err(Stop(
                    Exit::Interrupted,
                    "the jobs continue\n  help: --attach shows their progress, --cancel ends them"
                        .to_owned(),
                ));
            }
            thread::sleep(TICK);
        }
    }
}

/// Ends the jobs.
pub(super) fn cancel(output: &Path) -> Result<Exit, Stop> {
    let active = active(output)?.len();
    call(Command::new("scancel").arg(format!("--name={}", job_name(output)?)))?;
    complain(
        "note",
        match active {
            0 => "there are no jobs for these results".to_owned(),
            _ => "the jobs are cancelled; their results stay\n  help: continue with --resume"
                .to_owned(),
        },
    );
    Ok(Exit::Passed)
}

/// The jobs of these results that have not ended. A part of an array that waits is one job.
fn active(output: &Path) -> Result<Vec<Job>, Stop> {
    let name = job_name(output)?;
    let text = call(Command::new("squeue").arg("--json"))?;
    parse(&text, &name).ok_or_else(|| Stop::bad_input("squeue --json: no list of jobs"))
}

fn parse(text: &str, name: &str) -> Option<Vec<Job>> {
    let answer: Value = serde_json::from_str(text).ok()?;
    let ours = answer["jobs"].as_array()?.iter().filter(|job| job["name"] == name);
    let states = ours.filter_map(|job| {
        // A list of a state and its flags since Slurm 23.11.
        let state = &job["job_state"];
        let state = state.as_str().or_else(|| state[0].as_str()).unwrap_or_default();
        let reason = job["state_reason"].as_str().unwrap_or_default();
        let is_usual = state != "PENDING" || reason.is_empty() || USUAL.contains(&reason);
        (!ENDED.contains(&state)).then(|| Job {
            is_running: state == "RUNNING",
            reason: (!is_usual).then(|| reason.replace('_', " ")),
        })
    });
    Some(states.collect())
}

/// The name of all jobs of these results.
fn job_name(output: &Path) -> Result<String, Stop> {
    let path = real(output)?;
    let hash = hash_bytes(path.as_os_str().as_encoded_bytes());
    Ok(format!("grade-{}", &hash[..16]))
}

/// The standard output of a command of Slurm.
fn call(command: &mut Command) -> Result<String, Stop> {
    let name = command.get_program().display().to_string();
    let output = command.stdin(Stdio::null()).output().map_err(|error| {
        Stop::bad_input(format!("{name}: {error}\n  help: --on slurm needs the commands of Slurm"))
    })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(Stop::bad_input(format!("{name}: {}", said.trim())));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// A path as one word of the shell.
fn quoted(path: &Path) -> Result<String, Stop> {
    let text = path.to_str().ok_or_else(|| {
        Stop::bad_input(format!("{}: is not UTF-8, and cannot be part of a job", path.display()))
    })?;
    Ok(platforms::shell_word(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_are_recognised_in_the_answers_of_old_and_new_versions() {
        let old = r#"{"jobs": [
            {"name": "a", "job_state": "RUNNING", "state_reason": "None"},
            {"name": "b", "job_state": "RUNNING", "state_reason": "None"},
            {"name": "a", "job_state": "PENDING", "state_reason": "JobArrayTaskLimit"},
            {"name": "a", "job_state": "PENDING", "state_reason": "launch_failed_requeued_held"},
            {"name": "a", "job_state": "COMPLETED", "state_reason": "None"}]}"#;
        let new = r#"{"jobs": [
            {"name": "a", "job_state": ["RUNNING"], "state_reason": "None"},
            {"name": "a", "job_state": ["CANCELLED", "COMPLETING"], "state_reason": "None"}]}"#;
        let of = |text: &str| {
            let jobs = parse(text, "a").unwrap();
            jobs.into_iter().map(|job| (job.is_running, job.reason)).collect::<Vec<_>>()
        };
        let held = Some("launch failed requeued held".to_owned());
        assert_eq!(of(old), [(true, None), (false, None), (false, held)]);
        assert_eq!(of(new), [(true, None)]);
        assert!(parse("{}", "a").is_none());
    }

    #[test]
    fn a_path_is_one_word_of_the_shell() {
        let path = "/a b/it's $HOME";
        let word = quoted(Path::new(path)).ok().unwrap();
        let echo = Command::new("sh").arg("-c").arg(format!("printf %s {word}")).output();
        assert_eq!(String::from_utf8(echo.unwrap().stdout).unwrap(), path);
    }
}
