#!/usr/bin/env bash
# The course's own scenes against the course's own traces, where they are at hand.
# Their folder: $SPRING_ORACLE_FOSSSIM, or ../shared/fosssim beside this repository.
set -euo pipefail
cd "$(dirname "$0")/.."

course=${SPRING_ORACLE_FOSSSIM:-../shared/fosssim}
if [ ! -d "$course/scenes" ]; then
    echo "conformance: skipped, there is no $course/scenes"
    exit 0
fi
echo "+ grade --assets $course/scenes --expected $course/traces"
cargo run --release --locked --quiet --bin grade -- \
    --assets "$course/scenes" --expected "$course/traces"
echo "conformance: passed"
