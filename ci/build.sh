#!/usr/bin/env bash
# The first build of a newcomer, in an empty target folder: units, processor time, time. By hand: it takes minutes.
set -euo pipefail
cd "$(dirname "$0")/.."

# Compilations and runs of build scripts.
most_units=205

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
echo "+ cargo build --release --bin grade, in an empty target folder"
TIMEFORMAT="%R s; processor: %U s user, %S s system"
time CARGO_TARGET_DIR=$folder cargo build --release --bin grade --locked --message-format json >"$folder/messages"
units=$(grep -c '"reason":"compiler-artifact"\|"reason":"build-script-executed"' "$folder/messages")
echo "$units units (limit $most_units); load: $(cut -d' ' -f1 /proc/loadavg 2>/dev/null || echo unknown)"
if [ "$units" -gt "$most_units" ]; then
    echo "build: too many units; \`cargo build --timings\` shows them"
    exit 1
fi
echo "build: passed"
