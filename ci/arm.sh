#!/usr/bin/env bash
# Builds both programs for Linux on Arm and runs them under qemu: all traces of the suite, compared with the stored ones
# byte by byte, and the built-in simulator graded. Needs gcc-aarch64-linux-gnu, libc6-dev-arm64-cross and qemu-user.
set -euo pipefail
cd "$(dirname "$0")/.."
. ci/cross.sh

target=aarch64-unknown-linux-gnu
if ! command -v qemu-aarch64 >/dev/null || ! command -v aarch64-linux-gnu-gcc >/dev/null; then
    echo "arm: skipped: qemu-user or gcc-aarch64-linux-gnu is not installed"
    exit 0
fi
echo "+ cargo build --target $target"
cross build $target --release --bin grade --bin simulate
built=target/$target/release
[ -x $built/grade ] || built=$CROSS_FOLDER/$target/release
arm() { qemu-aarch64 -L /usr/aarch64-linux-gnu "$@"; }

traces=$(mktemp -d)
trap 'rm -rf "$traces"' EXIT
same=0
differs=()
while read -r expected; do
    name=${expected#expected/}
    name=${name%.csv}
    scene=$(ls assets/"$name".{xml,json} extracreditassets/"$name".{xml,json} 2>/dev/null | head -1)
    arm "$built/simulate" "$scene" -o "$traces/trace.csv" 2>/dev/null
    if cmp -s "$traces/trace.csv" "$expected"; then
        same=$((same + 1))
    else
        differs+=("$name")
    fi
done < <(find expected -name '*.csv' | sort)
echo "arm: $same traces have the same bytes as on x86-64"
if [ ${#differs[@]} -gt 0 ]; then
    printf 'arm: differs: %s\n' "${differs[@]}"
    exit 1
fi
arm "$built/grade" --no-progress | grep -aE 'Required|All passed'
