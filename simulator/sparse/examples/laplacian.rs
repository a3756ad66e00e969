//! Heat in a square net of nodes: two implicit steps of `(I + L) x' = x`, with the Laplacian `L` of the net.
//!
//! `cargo run --release -p sparse --example laplacian`

#![expect(clippy::print_stdout, reason = "an example prints its result")]

use nalgebra::Matrix1;
use sparse::LinearError;
use sparse::linear::{BlockMatrix, LinearSolver, Link};
use sparse::statistics::LinearStatistics;

/// Nodes a side.
const SIDE: usize = 300;

fn main() -> Result<(), LinearError> {
    let node = |row: usize, column: usize| row * SIDE + column;
    let mut links = Vec::new();
    for row in 0..SIDE {
        for column in 0..SIDE {
            if column + 1 < SIDE {
                links.push([node(row, column), node(row, column + 1)]);
            }
            if row + 1 < SIDE {
                links.push([node(row, column), node(row + 1, column)]);
            }
        }
    }
    let all: Vec<Link> = links.iter().map(|&blocks| Link { blocks, symmetric: true }).collect();
    let mut matrix = BlockMatrix::<1>::new(SIDE * SIDE, &all, LinearSolver::Auto);
    (0..SIDE * SIDE).for_each(|node| matrix.add_diagonal(node, 1.0));
    for pair in links {
        if let Some(slot) = matrix.pair_slot(pair) {
            matrix.add_pair(slot, &Matrix1::new(1.0));
        }
    }
    let mut heat = vec![0.0; SIDE * SIDE];
    heat[node(SIDE / 2, SIDE / 2)] = 1.0;
    let mut statistics = LinearStatistics::default();
    matrix.solve(&mut heat, &mut statistics)?;
    matrix.solve_again(&mut heat, &mut statistics)?;
    println!("{}", matrix.describe());
    println!("heat in the middle after two steps: {:.6}", heat[node(SIDE / 2, SIDE / 2)]);
    println!("heat in all nodes: {:.12}", heat.iter().sum::<f64>());
    println!("largest residual: {:.1e}", statistics.worst_residual);
    Ok(())
}
