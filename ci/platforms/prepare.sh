# Sourced by ci/platforms.sh and ci/roots.sh: what both need. Sets python, an interpreter with jsonschema, xmlschema and PyYAML, and
# setting, a program that refuses namespaces and drops capabilities; builds grade. Says what is missing, and ends.

job=$(basename "$0" .sh)

skip() {
    echo "$job: skipped: $1"
    exit 0
}

[ "$(uname -s)-$(uname -m)" = Linux-x86_64 ] || skip "the packages are for x86-64 Linux"
[ "$(id -u)" = 0 ] || skip "containers can be emulated only by root"
for program in python3 c++ cc unshare; do
    command -v "$program" >/dev/null || skip "$program is not installed"
done
python=python3
if ! python3 -c "import jsonschema, xmlschema, yaml" 2>/dev/null; then
    echo "+ pip install jsonschema xmlschema pyyaml"
    python3 -m venv target/platforms/python && target/platforms/python/bin/pip install --quiet jsonschema xmlschema pyyaml \
        || skip "jsonschema, xmlschema and PyYAML could not be installed"
    python=target/platforms/python/bin/python
fi

echo "+ cargo build --release --bin grade"
cargo build --release --locked --quiet -p grade --bin grade
mkdir -p target/platforms
# It runs in other systems as well.
setting=target/platforms/setting
cc -static -o "$setting" grader/grade/tests/attacks/setting.c
