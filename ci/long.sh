#!/usr/bin/env bash
# The tests that take long: each attack in each setting, all programs that the black-box probe judges, two thousand
# random forests, all planted mistakes, and scenes of others, where they are at hand.
set -euo pipefail
cd "$(dirname "$0")/.."

echo "+ cargo test --release --tests -- --ignored long_"
cargo test --release --tests -- --ignored long_
