#!/usr/bin/env bash
# Emulates course platforms as their documentation describes them, and hands submissions in: right, wrong, not building,
# late, hanging, malicious. Results are validated by jsonschema. Says what it skips.
set -euo pipefail
cd "$(dirname "$0")/.."

skip() {
    echo "platforms: skipped: $1"
    exit 0
}

[ "$(uname -s)-$(uname -m)" = Linux-x86_64 ] || skip "the packages are for x86-64 Linux"
[ "$(id -u)" = 0 ] || skip "containers can be emulated only by root"
for program in python3 c++ cc unshare; do
    command -v "$program" >/dev/null || skip "$program is not installed"
done
python=python3
if ! python3 -c "import jsonschema, yaml" 2>/dev/null; then
    echo "+ pip install jsonschema pyyaml"
    python3 -m venv target/platforms/python && target/platforms/python/bin/pip install --quiet jsonschema pyyaml \
        || skip "jsonschema and PyYAML could not be installed"
    python=target/platforms/python/bin/python
fi

echo "+ cargo build --release --bin grade"
cargo build --release --locked --quiet -p grade --bin grade
mkdir -p target/platforms
cc -o target/platforms/setting grader/grade/tests/attacks/setting.c
for platform in gradescope prairielearn github; do
    echo "+ ci/platforms/$platform.py"
    "$python" "ci/platforms/$platform.py" target/release/grade . target/platforms/setting
done
echo "platforms: passed"
