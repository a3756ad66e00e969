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
