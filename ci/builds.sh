#!/usr/bin/env bash
# Judges twelve right programs in eight builds each by the tolerances (ci/builds.py): compilers, flags, processors, systems and their
# libraries. Installs compilers, qemu and Wine if it can, as root.
set -euo pipefail
cd "$(dirname "$0")/.."

. ci/cross.sh
need g++ g++ aarch64-linux-gnu-g++ g++-aarch64-linux-gnu i686-linux-gnu-g++ g++-i686-linux-gnu \
    x86_64-w64-mingw32-g++ g++-mingw-w64-x86-64 qemu-aarch64 qemu-user wine wine
# A compiler with musl's libraries for C++.
tools=target/builds-tools
[ -d $tools ] || { python3 -m venv $tools && $tools/bin/pip install --quiet ziglang; }
cargo build --release --locked --quiet --bin grade
export WINEARCH=win64 WINEPREFIX=$PWD/$tools/wine WINEDEBUG=-all
mkdir -p "$WINEPREFIX"
# Wine's server stays: one that ends while the next program begins takes it along.
wineserver -p
trap 'wineserver -k' EXIT
wineboot --init >/dev/null 2>&1
$tools/bin/python ci/builds.py target/release/grade
echo "builds: passed"
