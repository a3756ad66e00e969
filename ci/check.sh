#!/usr/bin/env bash
# Formatting, lints and documentation, each with warnings denied.
set -euo pipefail
cd "$(dirname "$0")/.."

run() {
    echo "+ $*"
    "$@"
}

# Whoever has cargo may not have these yet.
run cargo fmt --version || run rustup component add rustfmt
run cargo clippy --version || run rustup component add clippy

run cargo fmt --all --check
run cargo clippy --release --workspace --all-targets --locked -- -D warnings
RUSTDOCFLAGS="-D warnings" run cargo doc --release --workspace --no-deps --document-private-items --locked
echo "check: passed"
