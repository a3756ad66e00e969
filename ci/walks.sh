#!/usr/bin/env bash
# Carries out docs/adding-a-force.md, the pages of ci/walks/ and docs/adding-an-integrator.md in copies of this tree:
# applies what a page documents, runs its commands, and checks that every part of the project knows the newcomer. Plants
# mistakes in each new force, and checks that a report finds them. Then leaves out one documented file after another,
# and checks that each time something fails and names the newcomer.
#
#     ci/walks.sh           all of that: half an hour
#     ci/walks.sh WORD      the walks whose page's path contains this word
#     ci/walks.sh apply     applies all pages and counts, without building
#
# Built dependencies are taken from target/release; the crates of the workspace are built with less optimisation.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
work=$root/target/walks
# A separate folder from walks that are being made.
[ "${1:-}" = apply ] && work=$root/target/walks/apply
tree=$work/tree
export CARGO_INCREMENTAL=1 CARGO_TARGET_DIR=$work/target
most_files=5
most_lines=150

mkdir -p "$work"
if [ "${1:-}" != apply ] && [ ! -d "$CARGO_TARGET_DIR/release" ] && [ -d target/release ]; then
    mkdir -p "$CARGO_TARGET_DIR/release"
    # Links, not copies: Cargo replaces files, and does not change them.
    for part in deps build .fingerprint; do
        cp -al "target/release/$part" "$CARGO_TARGET_DIR/release/"
    done
fi

fail() {
    echo "walks: $*" >&2
    exit 1
}

# Runs a command with its output in $work/output, which is shown where it fails.
run() {
    echo "+ $*"
    "$@" >"$work/output" 2>&1 || { tail -n 60 "$work/output" >&2; fail "failed: $*"; }
}

# The last output has a line with these words.
expect() {
    grep -aqE -- "$1" "$work/output" || { tail -n 40 "$work/output" >&2; fail "no line with: $1"; }
    echo "    $(grep -aE -m 1 -- "$1" "$work/output" | sed 's/^ *//' | cut -c 1-150)"
}

# The tree as it is. Only files that differ are written, so that Cargo builds again what has changed.
fresh_tree() {
    rm -rf "$work/next"
    mkdir -p "$work/next" "$tree"
    git ls-files -co --exclude-standard | while read -r file; do
        [ -f "$file" ] && echo "$file"
    done | tar -cf - -T - | tar -xf - -C "$work/next"
    mkdir -p "$work/next/.cargo"
    sed -n 's/^name = "\(.*\)"/\1/p' "$work"/next/*/Cargo.toml "$work"/next/grader/*/Cargo.toml \
        "$work"/next/simulator/{frames,scene,simulate}/Cargo.toml | sort -u \
        | sed 's/.*/[profile.release.package.&]\nopt-level = 1/' >"$work/next/.cargo/config.toml"
    # Files that are there and should not be.
    (cd "$tree" && find . -type f) | while read -r file; do
        [ -f "$work/next/$file" ] || rm -f "$tree/$file"
    done
    (cd "$work/next" && find . -type f) | while read -r file; do
        if ! cmp -s "$work/next/$file" "$tree/$file"; then
            mkdir -p "$tree/$(dirname "$file")"
            cp "$work/next/$file" "$tree/$file"
        fi
    done
    rm -rf "$work/next"
}

# Splits a page into $work/steps: NN.path has the file's path, NN.diff or NN.new its change; commands has its commands.
read_page() {
    rm -rf "$work/steps"
    mkdir -p "$work/steps"
    awk -v steps="$work/steps" '
        /^New file `.*`:$/ { split($0, parts, "`"); path = parts[2]; next }
        /^```(rust|xml)$/ && path != "" { kind = "new"; start(); next }
        /^```diff$/ { kind = "diff"; path = ""; start(); next }
        /^```$/ { if (inside) { inside = 0; path = "" } next }
        inside {
            print > file
            if (kind == "diff" && sub(/^\+\+\+ b\//, "")) { print > (steps "/" number ".path") }
        }
        function start() {
            number = sprintf("%02d", ++count)
            file = steps "/" number "." kind
            inside = 1
            if (kind == "new") { print path > (steps "/" number ".path") }
        }' "$1"
    # All forces have the commands of one page.
    case $1 in ci/walks/*) set -- docs/adding-a-force.md ;; esac
    awk '/^```sh$/ { inside = 1; next } /^```$/ { inside = 0 } inside' "$1" >"$work/steps/commands"
}

# Applies every step of the page but the one with this number.
apply_but() {
    local number path
    for path in "$work"/steps/*.path; do
        number=$(basename "$path" .path)
        [ "$number" = "$1" ] && continue
        if [ -f "$work/steps/$number.new" ]; then
            mkdir -p "$tree/$(dirname "$(cat "$path")")"
            cp "$work/steps/$number.new" "$tree/$(cat "$path")"
        else
            (cd "$tree" && patch -s -p1 --fuzz=0 <"$work/steps/$number.diff") \
                || fail "the page's change of $(cat "$path") does not apply: bring the page up to date"
        fi
    done
}

count() {
    local files lines
    files=$(cat "$work"/steps/*.path | sort -u | wc -l)
    lines=$(cat /dev/null "$work"/steps/*.new | wc -l)
    lines=$((lines + $(cat /dev/null "$work"/steps/*.diff | grep -cE '^(\+[^+]|\+$|-[^-]|-$)')))
    echo "    $files files, $lines lines"
    [ "$files" -le "$most_files" ] && [ "$lines" -le "$most_lines" ] \
        || fail "$1: more than $most_files files or $most_lines lines"
}

grade() {
    run "$CARGO_TARGET_DIR/release/grade" "$@"
}

# The page's commands, in the tree, by what is built already.
run_commands() {
    while read -r command; do
        command=${command/cargo run --release -p grade --/"$CARGO_TARGET_DIR/release/grade"}
        command=${command/cargo test --release/"${tests[*]}"}
        run bash -c "$command"
    done <"$work/steps/commands"
}

# $1: the words that must stand in what fails.
must_fail() {
    local words=$1
    shift
    echo "+ $*    (must fail)"
    if "$@" >"$work/output" 2>&1; then
        fail "nothing failed: $*"
    fi
    expect "$words"
}

# The checks that fail where this file is left out: $2 names the newcomer.
leave_out() {
    local number=$1 words=$2
    shift 2
    echo "== without $(cat "$work/steps/$number.path")"
    cd "$root"
    fresh_tree
    apply_but "$number"
    cd "$tree"
    must_fail "$words" "$@"
}

# One set of packages, so that each command uses what the one before it has built.
tests=(cargo test --release --locked -p grade -p simulator -p simulate -p reference -p diagnosis)

walk() {
    echo "== $1"
    cd "$root"
    fresh_tree
    read_page "$1"
    count "$1"
    apply_but none
    cd "$tree"
}

if [ "${1:-}" = apply ]; then
    for page in docs/adding-a-force.md ci/walks/*.md docs/adding-an-integrator.md; do
        walk "$page"
    done
    echo "walks: all pages apply"
    exit 0
fi
wanted=${1:-}

# Plants a mistake in a file of the new force, and checks that a report on the program with it has these words.
plant() {
    local group=$1 file=$2 mistake=$3 words=$4
    cp "$file" "$work/right"
    sed -i "$mistake" "$file"
    cmp -s "$file" "$work/right" && fail "no such place in $file: $mistake"
    run cargo build --release --locked -p simulate
    must_fail "$words" "$CARGO_TARGET_DIR/release/grade" "$CARGO_TARGET_DIR/release/simulate" --only "$group"
    cp "$work/right" "$file"
}

# The walk of a page that adds a force: its tag, title and the folder of its scene. More arguments are pairs of a mistake
# in the force's own file, as an expression for sed, and the words of the finding.
force_walk() {
    local page=$1 tag=$2 title=$3 group=$4 scene file number path
    shift 4
    case $page in *"$wanted"*) ;; *) return ;; esac
    walk "$page"
    scene=$group/$(basename "$(cat "$work"/steps/*.path | grep '\.xml$')" .xml)
    file=$(cat "$work/steps/01.path")
    run "${tests[@]}" --test it --test facts --test forms --test laws --no-run
    must_fail "$tag" "${tests[@]}" --test it docs::the_methods
    must_fail "$scene" "$CARGO_TARGET_DIR/release/grade" oracle verify
    run_commands
    run "${tests[@]}" --test it docs::the_
    expect "test result: ok"
    grep -q "$tag" docs/methods.md || fail "docs/methods.md does not list the force"
    run "$CARGO_TARGET_DIR/release/simulate" --help
    expect "$tag"
    grade --only "$group"
    expect "1 of 1 features +1/1"
    grade jacobians --force "$tag"
    expect "$tag"
    expect "correct, 0 wrong"
    grade jacobians "$CARGO_TARGET_DIR/release/simulate" --force "$tag"
    expect "$tag"
    expect "All that is offered is correct"
    grep -A 3 "$scene" expected/envelopes.toml >"$work/output" || true
    expect "${scene#*/}"
    grade selftest --in-process --subject "$title" --markdown
    expect "$title \| twice as large \| Rust \| [1-9]"
    expect "$title \| half as large \| Rust \| [1-9]"
    run "${tests[@]}" --test facts --test forms --test laws
    while [ $# -gt 0 ]; do
        plant "$group" "$file" "$1" "$2"
        shift 2
    done
    for path in "$work"/steps/*.path; do
        number=$(basename "$path" .path)
        case $(cat "$path") in
            "$file") leave_out "$number" "$(basename "$file" .rs)" "${tests[@]}" --test facts ;;
            */force/mod.rs) leave_out "$number" "$tag" "${tests[@]}" --test laws ;;
            */law/*) leave_out "$number" "$tag has no law" "${tests[@]}" --test laws ;;
            */forms.rs) leave_out "$number" "$tag has no forms" "${tests[@]}" --test forms ;;
            *.xml) leave_out "$number" "no scene has <$tag>" "${tests[@]}" --test facts ;;
            *) fail "$page: nothing is known to fail without $(cat "$path")" ;;
        esac
    done
}

force_walk docs/adding-a-force.md quadraticdrag "quadratic drag" QuadraticDrag \
    's/-self.drag \* at.w/-2.0 * self.drag * at.w/' "quadraticdrag is multiplied by 2" \
    's/shape \* -self.drag/shape * (-0.5 * self.drag)/' "dF/dv of quadraticdrag"
force_walk ci/walks/lennard-jones.md lennardjonesforce "Lennard-Jones force between two particles" LennardJones \
    's/s6 \* (2.0 \* s6 - 1.0)/s6 * (s6 - 1.0)/' "lennardjonesforce" \
    's/28.0 \* s6/14.0 * s6/' "dF/dx of lennardjonesforce"
force_walk ci/walks/bending-spring.md bendingforce "bending spring" Bending \
    's/(-self.kb \* (c/(-2.0 * self.kb * (c/' "bendingforce is multiplied by 2" \
    's/\* -self.kb;/* self.kb;/' "dF/dx of bendingforce" \
    's/\[(0, 0), (0, 1), (1, 0), (1, 1)\]/[(0, 0), (1, 1)]/' "dF/dx of bendingforce lacks its blocks between"

case docs/adding-an-integrator.md in *"$wanted"*) ;; *) echo "walks: passed"; exit 0 ;; esac
walk docs/adding-an-integrator.md
run "${tests[@]}" --test it --test facts --test laws --no-run
must_fail "position-verlet" "${tests[@]}" --test it docs::the_methods
must_fail "PositionVerlet/three-masses" "$CARGO_TARGET_DIR/release/grade" oracle verify
run_commands
run "${tests[@]}" --test it docs::the_
expect "test result: ok"
grep -q 'position-verlet' docs/methods.md || fail "docs/methods.md does not list the integrator"
grade --only PositionVerlet
expect "1 of 1 features +1/1"
grade stability --quick
expect "position-verlet"
expect "All is as expected"
grep -A 3 'PositionVerlet/three-masses' expected/envelopes.toml >"$work/output" || true
expect "three-masses"
grade selftest --in-process --subject position-verlet --markdown
expect "position-verlet \| its last substep missing \| Rust \| [1-9]"
run "${tests[@]}" --test facts --test laws
leave_out 01 "position_verlet" "${tests[@]}" --test facts
leave_out 02 "position-verlet" "${tests[@]}" --test facts
leave_out 03 "PositionVerlet" "${tests[@]}" --test facts
leave_out 04 "PositionVerlet" "${tests[@]}" --test laws
leave_out 05 "no scene has position-verlet" "${tests[@]}" --test facts
echo "walks: passed"
