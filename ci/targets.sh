#!/usr/bin/env bash
# Checks that everything compiles for the systems of students: Windows, macOS and Linux on Arm, and for a page of a
# browser. Debian's packages build the standard library from its sources where rustup cannot fetch it.
#
#     ci/targets.sh             all targets
#     ci/targets.sh TARGET…     these
set -euo pipefail
cd "$(dirname "$0")/.."
. ci/cross.sh

[ $# -gt 0 ] || set -- "${TARGETS[@]}"
failed=()
for target; do
    echo "+ cargo check --target $target"
    # A page has `grade` alone.
    what=(--workspace --bins --lib)
    [ "$target" != wasm32-wasip1 ] || what=(-p grade --bin grade)
    cross check "$target" "${what[@]}" || failed+=("$target")
done
[ ${#failed[@]} -eq 0 ] || { echo "targets: failed: ${failed[*]}"; exit 1; }
echo "targets: $# compile"
