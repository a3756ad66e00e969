#!/usr/bin/env bash
# The README's two commands.
set -euo pipefail
cd "$(dirname "$0")/.."

echo "+ cargo run --release --bin grade"
cargo run --release --bin grade
echo "+ cargo test --release"
cargo test --release
