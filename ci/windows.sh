#!/usr/bin/env bash
# Builds both programs for Windows and runs them under Wine: traces, archives, programs, limits, pages, paths, line ends; then
# the tests of the core.
# Needs the target of rustup or rustc-web, cargo-web and rust-web-src.
set -euo pipefail
cd "$(dirname "$0")/.."
. ci/cross.sh

target=x86_64-pc-windows-gnu
need wine wine x86_64-w64-mingw32-gcc gcc-mingw-w64-x86-64
echo "+ cargo build --target $target"
cross build $target --release --bin grade --bin simulate
built=target/$target/release
[ -x $built/grade.exe ] || built=$CROSS_FOLDER/$target/release

work=$PWD/target/windows
rm -rf "$work"
mkdir -p "$work/bin" "$work/my work" "$work/prefix"
cp "$built/grade.exe" "$built/simulate.exe" "$work/bin"
x86_64-w64-mingw32-gcc -O1 -shared -o "$work/bin/bcryptprimitives.dll" ci/windows/prng.c -ladvapi32
x86_64-w64-mingw32-gcc -O1 -o "$work/bin/hangs.exe" ci/windows/hangs.c
export WINEARCH=win64 WINEPREFIX=$work/prefix WINEDEBUG=-all
# Wine's server stays: one that ends while the next program begins takes it along.
wineserver -p
trap 'wineserver -k' EXIT
wineboot --init >/dev/null 2>&1
repository=$PWD
cd "$work/my work"
grade() { wine ../bin/grade.exe "$@"; }
simulate() { wine ../bin/simulate.exe "$@"; }

# Submissions: the oracle's traces; the same with one wrong number, and with line ends of Windows; a zip.
cp -r "$repository/expected" right
rm right/*.toml
cp -r right wrong
scene=SpringDamping/shearing-triangle-linearized
sed -i '19s/\.\([0-9]\)[0-9]/.\199/' wrong/$scene.csv
cp -r right crlf
sed -i 's/$/\r/' crlf/$scene.csv
(cd right && python3 -m zipfile -c ../right.zip ./*)
cp "$repository/assets/$scene.xml" scene.xml
sed 's/$/\r/' scene.xml >crlf.xml
echo text >notes.txt

count=0
# check STATUS PATTERN COMMAND…: the exit status, and a line that is printed.
check() {
    local status=$1 pattern=$2 got=0
    shift 2
    "$@" >out.txt 2>&1 </dev/null || got=$?
    if [ "$got" != "$status" ] || { [ -n "$pattern" ] && ! grep -aqE -- "$pattern" out.txt; }; then
        echo "windows: failed: $*: status $got instead of $status, or no \"$pattern\" in:"
        tail -30 out.txt
        exit 1
    fi
    count=$((count + 1))
    echo "  ok  ${*/\/*\/bin\//}"
}

check 0 '^grade [0-9.]+' grade --version
check 0 '^simulate [0-9.]+' simulate --version
check 0 '' simulate scene.xml -o trace.csv
check 0 '' cmp trace.csv "right/$scene.csv"
check 0 '' simulate crlf.xml -o crlf.csv
check 0 '' cmp crlf.csv "right/$scene.csv"
check 0 '' simulate scene.xml -o trace.bin --plot plot.svg --film film.gif
check 2 ':1:1: this is not well-formed XML' simulate notes.txt
check 0 'All passed|Required' grade right
check 0 'All passed|Required' grade right --assignment t1m3
check 0 'All passed|Required' grade right.zip --assignment t1m3
check 0 'All passed|Required' grade crlf --assignment t1m3
check 0 'All passed|Required' grade 'right\' --assignment t1m3
check 1 'open report.html' grade wrong --assignment t1m3 --html report.html --report json=report.json --report junit=report.xml
check 0 "$scene" cat report.json report.xml
check 0 '<template' grep -a '<template' report.html
check 1 "$scene" grade wrong --assignment t1m3 --html pages
check 0 '' test -f pages/index.html
check 1 "Redoing each step" grade explain $scene wrong
check 2 'no submission|not executable' grade notes.txt
check 2 'not found' grade nothing
check 2 'unprotected' grade '..\bin\simulate.exe' --assignment t1m3
check 0 'All passed|Required' grade '..\bin\simulate.exe' --unprotected --assignment t1m3
check 0 'All passed|Required' grade ../bin/simulate.exe --unprotected --only SpringDamping
check 0 't1m3' grade assignments
check 0 '' grade init python skeleton
check 0 'submission.toml' ls skeleton
check 0 'Register-ArgumentCompleter' grade completions powershell
check 2 'protection' grade protection
# The program and its child end at the limit of time.
ALIVE=C:\\alive check 1 'time|limit' grade ../bin/hangs.exe --unprotected --only Spring --limit wall=1
sleep 7
check 1 '' test -e "$WINEPREFIX/drive_c/alive"
# Far from the repository, the scenes and the oracle are those of the program, byte for byte.
mkdir -p "$WINEPREFIX/drive_c/far"
cd "$WINEPREFIX/drive_c/far"
check 0 't1m3' wine "$work/bin/grade.exe" assignments
check 0 '' diff -r "$repository/expected" "$(echo "$WINEPREFIX"/drive_c/users/*/AppData/Local/spring-oracle/suite/*/expected)"
cd "$repository"
same_traces wine "$work/bin/simulate.exe"
check 0 'All passed|Required' wine "$work/bin/grade.exe" --no-progress
echo "windows: $count commands ran under $(wine --version)"

# The tests of the core.
cp "$work/bin/bcryptprimitives.dll" "$WINEPREFIX/drive_c/windows/system32"
echo "+ cargo test --target $target"
CARGO_TARGET_X86_64_PC_WINDOWS_GNU_RUNNER=wine cross test $target --release --tests --no-fail-fast -p scene -p sparse -p simulator -p reference \
    -p jacobian -p frames -p picture | tee "$work/tests"
awk '/^test result/ { passed += $4; failed += $6; ignored += $8 } END { print "windows: tests of the core: " passed " passed, " failed " failed, " ignored " ignored" }' "$work/tests"
