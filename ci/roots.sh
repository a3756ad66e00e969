#!/usr/bin/env bash
# Makes minimal roots of Debian and Ubuntu, unpacks the packages of Gradescope and PrairieLearn in them, installs with the
# network, and hands submissions in. Says what it skips.
set -euo pipefail
cd "$(dirname "$0")/.."

skip() {
    echo "roots: skipped: $1"
    exit 0
}

[ "$(uname -s)-$(uname -m)" = Linux-x86_64 ] || skip "the packages are for x86-64 Linux"
[ "$(id -u)" = 0 ] || skip "roots can be made only by root"
for program in python3 cc unshare; do
    command -v "$program" >/dev/null || skip "$program is not installed"
done
if ! command -v debootstrap >/dev/null; then
    echo "+ apt-get install debootstrap"
    { apt-get update -qq && apt-get install -y -qq debootstrap >/dev/null; } || skip "debootstrap could not be installed"
fi
mkdir -p target/roots
python=python3
if ! python3 -c "import jsonschema" 2>/dev/null; then
    echo "+ pip install jsonschema"
    python3 -m venv target/roots/python && target/roots/python/bin/pip install --quiet jsonschema \
        || skip "jsonschema could not be installed"
    python=target/roots/python/bin/python
fi

echo "+ cargo build --release --bin grade"
cargo build --release --locked --quiet -p grade --bin grade
cc -static -o target/roots/setting grader/grade/tests/attacks/setting.c
while read -r release mirror; do
    root=target/roots/$release
    rm -rf --one-file-system "$root"
    echo "+ debootstrap $release"
    # Debian has no keys of Ubuntu.
    if ! debootstrap --variant=minbase --no-check-gpg "$release" "$root" "$mirror" >target/roots/log 2>&1; then
        echo "roots: skipped: $release: $(tail -n 1 target/roots/log)"
        continue
    fi
    # Gradescope's package installs the compilers for both.
    for platform in gradescope prairielearn; do
        echo "+ ci/platforms/$platform.py, in $release"
        "$python" "ci/platforms/$platform.py" target/release/grade . target/roots/setting "$root"
    done
done <<'END'
bookworm http://deb.debian.org/debian
jammy http://archive.ubuntu.com/ubuntu
END
echo "roots: passed"
