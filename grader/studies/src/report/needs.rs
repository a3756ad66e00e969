//! Text report of the resources of each scene, one row per scene.

use std::io::{self, Write};

use crate::needs::{Excess, Need};
use report::table::{self, BAD, BOLD, Cell, header};

/// Writes one table per method; `allocations` per step, if counted, in the order of the scenes.
///
/// # Errors
/// If writing fails.
pub fn write(out: &mut dyn Write, needs: &[Need], allocations: Option<&[u64]>) -> io::Result<()> {
    writeln!(
        out,
        "{BOLD}Resources of each scene{BOLD:#}, and cost of the general path: in 3D, with every\n\
         force present, by sparse matrices"
    )?;
    let mut methods: Vec<&str> = Vec::new();
    for need in needs {
        if !methods.contains(&need.method) {
            methods.push(need.method);
        }
    }
    for method in methods {
        writeln!(out, "\n{BOLD}{method}{BOLD:#}")?;
        let mut names = vec!["scene", "forces", "assemblies", "factors", "state"];
        names.extend(allocations.map(|_| "allocations"));
        names.extend(["a step", "general", "slower", "differs"]);
        let numbers = 1..names.len();
        let mut rows = vec![header(&names, numbers)];
        let of_method = |(_, need): &(usize, &Need)| need.method == method;
        for (idx, need) in needs.iter().enumerate().filter(of_method) {
            rows.push(row(need, allocations.map(|all| all[idx])));
        }
        table::write(out, &rows)?;
    }
    let more = needs.iter().filter(|need| !need.excess.is_empty()).count();
    let sum = |of: fn(&Need) -> f64| needs.iter().map(of).sum::<f64>();
    // The geometric mean gives all scenes equal weight.
    let logarithms = sum(|need| (need.general.seconds / need.given.seconds).ln());
    let mean = (logarithms / needs.len().max(1) as f64).exp();
    let worst = needs.iter().map(|need| need.difference).fold(0.0, f64::max);
    writeln!(
        out,
        "\n{} of {} scenes use only what they need; the general path takes {mean:.1} times\nas long on \
         average, and differs by at most {worst:.1e}",
        needs.len() - more,
        needs.len(),
    )
}

fn row(need: &Need, allocations: Option<u64>) -> Vec<Cell> {
    let Need { scene, given, general, difference, excess, .. } = need;
    let statistics = &given.statistics;
    let mut row = vec![
        Cell::left(match statistics.linear_solver.as_str() {
            "" => scene.clone(),
            solver => format!("{scene}: {solver}"),
        }),
        Cell::right(given.forces.len().to_string()),
        Cell::right(statistics.assemblies.to_string()),
        Cell::right(statistics.linear.factorisations.to_string()),
        Cell::right(format!("{} B", given.state_bytes)),
    ];
    row.extend(allocations.map(|count| Cell::right(count.to_string())));
    row.extend([
        Cell::right(microseconds(given.seconds)),
        Cell::right(microseconds(general.seconds)),
        Cell::right(format!("{:.1}×", general.seconds / given.seconds)),
        Cell::right(match difference {
            0.0 => "0".to_owned(),
            difference => format!("{difference:.1e}"),
        }),
    ]);
    if !excess.is_empty() {
        let words: Vec<&str> = excess.iter().copied().map(Excess::name).collect();
        row.push(Cell::left(format!("more than it needs: {}", words.join(", "))).styled(BAD));
    }
    row
}

fn microseconds(seconds: f64) -> String {
    format!("{:.2} µs", 1e6 * seconds)
}
