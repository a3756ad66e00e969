#!/usr/bin/env bash
# Builds both programs for Linux on Arm and runs them under qemu: all traces of the suite, compared with the stored ones
# byte by byte, and the built-in simulator graded.
set -euo pipefail
cd "$(dirname "$0")/.."
. ci/cross.sh

target=aarch64-unknown-linux-gnu
need qemu-aarch64 qemu-user aarch64-linux-gnu-gcc gcc-aarch64-linux-gnu
echo "+ cargo build --target $target"
cross build $target --release --bin grade --bin simulate
built=target/$target/release
[ -x $built/grade ] || built=$CROSS_FOLDER/$target/release
arm() { qemu-aarch64 -L /usr/aarch64-linux-gnu "$@"; }

far=$(mktemp -d)
trap 'rm -rf "$far"' EXIT
same_traces arm "$built/simulate"
# Far from the repository, the scenes and the oracle are those of the program, byte for byte.
grade=$(realpath "$built/grade")
(cd "$far" && XDG_CACHE_HOME=$far arm "$grade" assignments >/dev/null 2>&1)
diff -r expected "$far"/spring-oracle/suite/*/expected
arm "$built/grade" --no-progress | grep -aE 'Required|All passed'
