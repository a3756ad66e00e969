#!/usr/bin/env bash
# Changes of the syntax trees of right programs in C++, C and Python, drawn by the date, and what is found in them.
set -euo pipefail
cd "$(dirname "$0")/.."

target=${CARGO_TARGET_DIR:-$PWD/target}
python=$target/mutants/bin/python
[ -x "$python" ] || python3 -m venv "$target/mutants"
"$python" -m pip install --quiet 'tree-sitter>=0.25,<0.26' tree-sitter-c tree-sitter-cpp tree-sitter-python
cargo build --release --locked --quiet --bin grade
seed=${SPRING_ORACLE_SEED:-$(date +%Y%m%d)}
echo "+ ci/mutants.py $target/release/grade 240 $seed"
"$python" ci/mutants.py "$target/release/grade" 240 "$seed"
