#!/usr/bin/env bash
# Makes a wheel, target/wheel/spring_oracle-*.whl: the Python module, and the programs grade and simulate with their scenes
# and oracle as its scripts. Then tries it: installed by pip into a new environment, in an empty folder, without Rust.
set -euo pipefail
cd "$(dirname "$0")/.."

profile=${PACKAGE_PROFILE:-dist}
folder=target/wheel
tools=$folder/tools
rm -rf "$folder"/*.whl "$folder/unpacked"
mkdir -p "$folder"
[ -x $tools/bin/maturin ] || { python3 -m venv $tools && $tools/bin/pip install --quiet 'maturin>=1.7,<2' wheel; }
echo "+ cargo build --profile $profile --bin grade --bin simulate; maturin build"
cargo build --locked --quiet --profile "$profile" --bin grade --bin simulate
$tools/bin/maturin build --quiet --release --locked --manifest-path bindings/python/Cargo.toml --out $folder
# The programs beside the module: files in NAME.data/scripts are installed as commands.
$tools/bin/wheel unpack --dest $folder/unpacked $folder/*.whl
content=$(echo $folder/unpacked/*)
info=$(basename "$content"/*.dist-info)
mkdir -p "$content/${info%.dist-info}.data/scripts"
install -m 755 "target/$profile/grade" "target/$profile/simulate" "$content/${info%.dist-info}.data/scripts"
$tools/bin/wheel pack --dest-dir $folder "$content" >/dev/null
ls -l $folder/*.whl | awk '{ printf "    %s, %.1f MB\n", $9, $5 / 1e6 }'

wheel=$(echo "$PWD"/$folder/*.whl)
empty=$(mktemp -d)
trap 'rm -rf "$empty"' EXIT
cd "$empty"
began=$(date +%s)
python3 -m venv environment
environment/bin/pip install --quiet "$wheel"
mkdir work
cd work
export PATH=$empty/environment/bin:/usr/bin:/bin XDG_CACHE_HOME=$empty/cache
echo "+ grade simulate    (in an empty folder)"
grade "$(command -v simulate)" ${GRADE_ARGUMENTS:-} >report || true
grep -aE "Required|Score|All passed" report
echo "    verdict $(($(date +%s) - began)) s after the start of the installation"
python3 -c "import spring_oracle; print(spring_oracle.__name__, 'imported')"
grade --version
echo "wheel: passed"
