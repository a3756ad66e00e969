#!/usr/bin/env bash
# Formatting, lints and documentation, each with warnings denied.
set -euo pipefail
cd "$(dirname "$0")/.."

run() {
    echo "+ $*"
    "$@"
}

# An installation of cargo may lack these.
run cargo fmt --version || run rustup component add rustfmt
run cargo clippy --version || run rustup component add clippy

run cargo fmt --all --check
run cargo clippy --release --workspace --all-targets --locked -- -D warnings
RUSTDOCFLAGS="-D warnings" run cargo doc --release --workspace --no-deps --document-private-items --locked

# Each package is downloaded and most are built before the first command of a newcomer answers.
packages=$(grep -c '^name = ' Cargo.lock)
crates=$(cargo tree --locked --package grade --edges normal,build --prefix none --format '{p}' \
    | grep -v "($PWD" | sed 's/ (\*)$//' | sort -u | wc -l)
echo "Cargo.lock: $packages packages (limit 200); a first build: $crates crates of others (limit 125)"
if [ "$packages" -gt 200 ] || [ "$crates" -gt 125 ]; then
    echo "check: too many dependencies"
    exit 1
fi
# Where tests ask for more features of a dependency, all that stands on it is built twice.
features() {
    cargo tree --locked --workspace --edges "$1" --prefix none --format '{p} {f}' | sed 's/ (\*)$//' | sort -u
}
twice=$(comm -23 <(features normal,build) <(features normal,build,dev))
if [ -n "$twice" ]; then
    echo "$twice"
    echo "check: tests need other features of these packages than the first build"
    exit 1
fi
echo "check: passed"
