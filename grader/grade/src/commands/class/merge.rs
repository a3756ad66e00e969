//! The summary of a class, from the results of its plan.

use std::collections::BTreeSet;

use grader::boundary::printed;
use grader::class::plan::{Plan, Planned};
use grader::class::record::Record;
use grader::class::{Change, Row};
use grader::verdict::Fault;
use rayon::prelude::*;
use report::class::{Gap, Missing};
use report::html::{self, ClassResult};
use sandbox::Protection;

use super::save;
use super::setting::{Class, FIRST_PHASE};
use crate::output::print;
use crate::stop::{Exit, Stop, complain};

/// A result, or why there is none.
type Found = Result<Graded, Missing>;

/// The result of a submission.
struct Graded {
    row: Row,
    /// The protections under which its program ran.
    protection: Option<Vec<Protection>>,
    /// How its points changed, if they did.
    change: Option<Change>,
    /// Whether it has pages in the folder of this run.
    has_pages: bool,
}

impl Class<'_> {
    /// Writes and prints the summary of the results that there are, in the order of the plan.
    ///
    /// # Errors
    /// If it cannot be written, or a submission has no result.
    pub(super) fn merge(&self, plan: &Plan) -> Result<Exit, Stop> {
        let found: Vec<Found> =
            plan.submissions.par_iter().map(|planned| self.found(plan, planned)).collect();
        let (mut rows, mut names, mut gaps) = (Vec::new(), Vec::new(), Vec::new());
        // Only those of this plan: a result that stayed has not changed.
        let graded: BTreeSet<usize> = plan.shards.iter().flatten().copied().collect();
        let mut changes: Vec<Change> = Vec::new();
        // Those that were in force wherever programs ran.
        let mut protections: Option<Vec<Protection>> = None;
        for (place, (planned, found)) in plan.submissions.iter().zip(found).enumerate() {
            match found {
                Ok(Graded { row, protection: in_force, change, has_pages }) => {
                    changes.extend(change.filter(|_| graded.contains(&place)));
                    rows.push(row);
                    names.push(has_pages.then_some(&*planned.report));
                    protections = match (protections, in_force) {
                        (Some(mut known), Some(in_force)) => {
                            known.retain(|protection| in_force.contains(protection));
                            Some(known)
                        }
                        (known, in_force) => known.or(in_force),
                    };
                }
                Err(missing) => gaps.push(Gap { name: &planned.name, missing }),
            }
        }
        let protections = protections.unwrap_or_else(|| Protection::ALL.to_vec());
        let cases = &self.inputs.suite.cases;
        let unjudged = cases.iter().filter_map(|case| Some((case, self.oracle.fault(case)?)));
        let unjudged: Vec<(String, Fault)> =
            unjudged.map(|(case, fault)| (case.id.clone(), fault)).collect();
        let mut remarks = self.marks.as_ref().map_or_else(Vec::new, |marks| marks.remarks.clone());
        // Those who lost most come first.
        changes.sort_by(|a, b| a.difference.total_cmp(&b.difference));
        remarks.extend(changes.into_iter().map(|change| change.message));
        let equal = self.equal(plan).into_iter();
        remarks.extend(equal.map(|names| {
            let names: Vec<String> = names.iter().map(|name| printed::text(name)).collect();
            format!("equal hand-ins: {}", names.join(", "))
        }));
        remarks.extend(self.write_gradebooks(plan, &rows)?);
        let csv = report::class::csv(&rows, &gaps).map_err(Stop::fault)?;
        save(&self.output.join("summary.csv"), &csv)?;
        let assignment = self.inputs.assignment.as_ref();
        let mut text = assignment.map_or_else(Vec::new, |assignment| {
            format!("Assignment {}: {}\n", assignment.name, assignment.title).into_bytes()
        });
        let summary = report::class::Summary {
            rows: &rows,
            unjudged: &unjudged,
            gaps: &gaps,
            passed_over: &plan.passed_over,
            protections: &protections,
            provenance: &self.provenance,
            remarks: &remarks,
        };
        report::class::write(&mut text, &summary).map_err(Stop::fault)?;
        save(&self.output.join("summary.txt"), &text)?;
        self.progress.clear();
        print(&text)?;
        if let Some(pages) = &self.pages {
            let lacking = names.iter().filter(|name| name.is_none()).count();
            if lacking > 0 {
                complain(
                    "note",
                    format!(
                        "{lacking} submissions were graded without --html, and have no pages; grade without --resume to \
                         write them"
                    ),
                );
            }
            let rows: Vec<_> = rows.iter().zip(names).collect();
            let result = ClassResult {
                rows: &rows,
                gaps: &gaps,
                passed_over: &plan.passed_over,
                protections: &protections,
                provenance: &self.provenance,
            };
            pages.publish(|sink| html::class(&result, sink))?;
        }
        if !gaps.is_empty() {
            let (done, total) = (rows.len(), plan.submissions.len());
            return Err(Stop(
                Exit::Interrupted,
                format!("{done} of {total} submissions graded\n  help: continue with --resume"),
            ));
        }
        // Remainders of phases without a result.
        let _ = std::fs::remove_dir_all(self.output.join(FIRST_PHASE));
        let is_open = |row: &Row| row.is_fault() || row.is_refused();
        let has_faults =
            !unjudged.is_empty() || !plan.passed_over.is_empty() || rows.iter().any(is_open);
        Ok(if has_faults { Exit::GraderFault } else { Exit::Passed })
    }

    fn found(&self, plan: &Plan, planned: &Planned) -> Found {
        match self.record(plan, planned) {
            Some(record) => {
                let has_pages = self.has_pages(planned, &record);
                let Record { row, protection, before, .. } = record;
                let change = before.and_then(|before| row.change(&before));
                Ok(Graded { row, protection, change, has_pages })
            }
            None if self.key(&planned.name).0 != planned.key => Err(Missing::Changed),
            None => {
                let path = self.record_path(planned);
                let record = Record::load(&path, &planned.report, &self.seal);
                Err(if record.is_err() { Missing::Altered } else { Missing::NotReached })
            }
        }
    }
}
