#!/usr/bin/env bash
# Planted mistakes and correct variants, in this process and as programs in other languages; 300 programs drawn by the
# date; and docs/selftest.md, which UPDATE_DOCS=1 writes anew.
set -euo pipefail
cd "$(dirname "$0")/.."

report=target/selftest.md
echo "+ grade selftest --markdown"
cargo build --release --locked --quiet --bin grade
status=0
target/release/grade selftest --markdown --output "$report" || status=$?
if [ "$status" -gt 1 ]; then
    echo "selftest: it could not be run"
    exit "$status"
fi
sed -n '/^## Rates/,/^## Correct/p' "$report" | sed '$d'
if [ "$status" -ne 0 ]; then
    echo "selftest: a target is missed; \`grade selftest\` shows which rows"
    exit "$status"
fi
seed=${SPRING_ORACLE_SEED:-$(date +%Y%m%d)}
echo "+ grade selftest --drawn 300 --seed $seed"
target/release/grade selftest --drawn 300 --seed "$seed" --details --output target/drawn.md || {
    cat target/drawn.md
    echo "selftest: a target of drawn programs is missed"
    exit 1
}
if [ "${UPDATE_DOCS:-}" = 1 ]; then
    cp "$report" docs/selftest.md
fi
# Where a row was skipped, for want of a compiler or a flag, the document says more than was run.
if grep -q "^Rows skipped:" "$report"; then
    echo "selftest: passed; rows were skipped, and docs/selftest.md is not compared"
elif diff docs/selftest.md "$report"; then
    echo "selftest: passed"
else
    echo "selftest: docs/selftest.md is not what came out; review it and run UPDATE_DOCS=1 ci/selftest.sh"
    exit 1
fi
