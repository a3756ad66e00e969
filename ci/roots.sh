#!/usr/bin/env bash
# Makes minimal roots of Debian and Ubuntu, unpacks the packages of Gradescope and PrairieLearn in them, installs with the
# network, and hands submissions in. Says what it skips.
set -euo pipefail
cd "$(dirname "$0")/.."
# shellcheck source=ci/platforms/prepare.sh
. ci/platforms/prepare.sh

if ! command -v debootstrap >/dev/null; then
    echo "+ apt-get install debootstrap"
    { apt-get update -qq && apt-get install -y -qq debootstrap >/dev/null; } || skip "debootstrap could not be installed"
fi
mkdir -p target/roots
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
        "$python" "ci/platforms/$platform.py" target/release/grade . "$setting" "$root"
    done
done <<'END'
bookworm http://deb.debian.org/debian
jammy http://archive.ubuntu.com/ubuntu
END
echo "roots: passed"
