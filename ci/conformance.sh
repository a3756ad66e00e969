#!/usr/bin/env bash
# The course's own scenes against the course's own traces, where they are at hand.
# Their folders: $SPRING_ORACLE_FOSSSIM and $SPRING_ORACLE_ELASTIC, or ../shared/fosssim and ../shared/elastic, relative
# to this repository.
set -euo pipefail
cd "$(dirname "$0")/.."

for course in "${SPRING_ORACLE_FOSSSIM:-../shared/fosssim}" "${SPRING_ORACLE_ELASTIC:-../shared/elastic}"; do
    if [ ! -d "$course/scenes" ]; then
        echo "conformance: skipped, there is no $course/scenes"
        continue
    fi
    echo "+ grade --assets $course/scenes --expected $course/traces"
    cargo run --release --locked --quiet --bin grade -- \
        --assets "$course/scenes" --expected "$course/traces"
done
echo "conformance: passed"
