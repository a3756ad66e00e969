#!/usr/bin/env bash
# Gradescope runs this once, as root and with the network, when it builds the image.
set -euo pipefail
# Tests give another folder than Gradescope's.
source="${AUTOGRADER_ROOT:-/autograder}/source"
export DEBIAN_FRONTEND=noninteractive

# Compilers and interpreters of the submissions.
apt-get update
apt-get install -y --no-install-recommends PACKAGES

BUILD
# Submissions run as another user, and must not read the oracle.
chmod 700 "$source"
chmod 755 "$source/grade"
"$source/grade" --version

# Where programs cannot be run under protection, every submission would have no points: no image is better.
cd "$source/suite"
if ! "$source/grade" protectionHIDDEN; then
    echo "setup.sh: the message above says what this system lacks, and which line of the rubric accepts less; export the" \
        "package again with that line" >&2
    exit 1
fi
