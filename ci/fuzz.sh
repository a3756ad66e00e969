#!/usr/bin/env bash
# Fuzzes the parsers of students' files, each for $1 seconds (600 where it is left out). No part of .ci/run:
# it needs `cargo install cargo-fuzz`. Failures are reported and kept in ci/fuzz/artifacts; put such an input
# into ci/fuzz/seeds/<target>/ with its correction, where `cargo test` tries it on every run.
set -euo pipefail
cd "$(dirname "$0")/fuzz"

seconds=${1:-600}
mkdir -p corpus
tar -xf seeds.tar -C corpus
for target in scene-xml scene-json trace-csv trace-fosssim archive examined export film manifest metadata printed record report sheet tokens; do
    echo "+ cargo fuzz run $target, for $seconds seconds"
    mkdir -p "corpus/$target" "seeds/$target"
    options=(-max_total_time="$seconds" -max_len=6000 -timeout=10 -rss_limit_mb=1024 -print_final_stats=1)
    if [ -f "dictionaries/$target.dict" ]; then
        options+=("-dict=dictionaries/$target.dict")
    fi
    # Without a sanitizer it builds with a stable toolchain; there is no unsafe code of ours to watch.
    cargo fuzz run --fuzz-dir . --sanitizer none --release "$target" "corpus/$target" "seeds/$target" -- "${options[@]}"
done
echo "fuzz: passed"
