//! What scenes need and are given: a row a scene, for people.

use std::io::{self, Write};

use super::table::{self, Cell};
use super::text::{BAD, BOLD, GOOD, header};
use crate::needs::{Excess, Need};

/// Writes the table; `allocations` of a step, where they were counted, in the order of the scenes.
///
/// # Errors
/// Where the output takes no more.
pub fn write(out: &mut dyn Write, needs: &[Need], allocations: Option<&[u64]>) -> io::Result<()> {
    writeln!(
        out,
        "{BOLD}What each scene is given{BOLD:#}, and what the general path costs it: in 3D, with every\n\
         force present, by sparse matrices"
    )?;
    let names = [
        "scene",
        "method",
        "solver",
        "forces",
        "assemblies",
        "factors",
        "state",
        "allocations",
        "a step",
        "general",
        "slower",
        "differs by",
        "",
    ];
    let mut rows = vec![header(&names, 3..12)];
    for (idx, need) in needs.iter().enumerate() {
        let Need { scene, method, given, general, difference, excess } = need;
        let statistics = &given.statistics;
        let solver = match statistics.linear_solver.as_str() {
            "" => "none",
            solver => solver,
        };
        let verdict = match excess.as_slice() {
            [] => Cell::left("as needed").styled(GOOD),
            all => {
                let words: Vec<&str> = all.iter().copied().map(Excess::name).collect();
                Cell::left(words.join(", ")).styled(BAD)
            }
        };
        let allocated = allocations.and_then(|all| all.get(idx));
        rows.push(vec![
            Cell::left(scene.as_str()),
            Cell::left(*method),
            Cell::left(solver),
            Cell::right(given.forces.len().to_string()),
            Cell::right(statistics.assemblies.to_string()),
            Cell::right(statistics.linear.factorisations.to_string()),
            Cell::right(format!("{} B", given.state_bytes)),
            Cell::right(allocated.map_or_else(|| "-".to_owned(), u64::to_string)),
            Cell::right(microseconds(given.seconds)),
            Cell::right(microseconds(general.seconds)),
            Cell::right(format!("{:.1}×", general.seconds / given.seconds)),
            Cell::right(match difference {
                0.0 => "0".to_owned(),
                difference => format!("{difference:.1e}"),
            }),
            verdict,
        ]);
    }
    table::write(out, &rows)?;
    let more = needs.iter().filter(|need| !need.excess.is_empty()).count();
    let sum = |of: fn(&Need) -> f64| needs.iter().map(of).sum::<f64>();
    // The geometric mean: no scene counts for more than another.
    let logarithms = sum(|need| (need.general.seconds / need.given.seconds).ln());
    let mean = (logarithms / needs.len().max(1) as f64).exp();
    let worst = needs.iter().map(|need| need.difference).fold(0.0, f64::max);
    writeln!(
        out,
        "\n{} of {} scenes are given what they need; the general path takes {mean:.1} times\nas long in the \
         mean, and differs by {worst:.1e} at most",
        needs.len() - more,
        needs.len(),
    )
}

fn microseconds(seconds: f64) -> String {
    format!("{:.2} µs", 1e6 * seconds)
}
