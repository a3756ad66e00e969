//! `cargo bench -p studies --bench needs`: the table of `grade needs` with the allocations per step, counted by a
//! global allocator. The first twelve steps, which allocate the workspaces, are not counted.

use std::path::Path;

use grader::suite::{Section, Suite};
use scene::ParseOptions;
use simulator::simulation::Simulation;
use studies::needs;

/// Enough steps to allocate every workspace.
const FIRST_STEPS: u64 = 12;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let sections = [
        (Section::Required, root.join("assets")),
        (Section::ExtraCredit, root.join("extracreditassets")),
    ];
    let suite = Suite::load(&sections, &ParseOptions::default())?;
    let mut all = Vec::new();
    for case in &suite.cases {
        all.push(needs::measure(&case.id, &case.scene)?);
    }
    let mut allocations = Vec::new();
    for case in &suite.cases {
        let mut simulation = Simulation::new(&case.scene);
        for _ in 0..FIRST_STEPS {
            simulation.advance()?;
        }
        let mut stepped = Ok(true);
        let counted = allocation_counter::measure(|| {
            while matches!(stepped, Ok(true)) {
                stepped = simulation.advance();
            }
        });
        stepped?;
        allocations.push(counted.count_total);
    }
    studies::report::needs::write(&mut anstream::stdout(), &all, Some(&allocations))?;
    Ok(())
}
