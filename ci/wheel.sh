#!/usr/bin/env bash
# Makes a wheel, target/wheel/spring_oracle-*.whl: the Python module, and the programs grade and simulate with their scenes
# and oracle as its scripts. Then tries it: installed by pip in a root with Debian's Python and nothing else, without a network,
# where grade judges a program in Python. Without root or debootstrap, in an empty folder of this machine.
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
# The programs of the module: files in NAME.data/scripts are installed as commands.
$tools/bin/wheel unpack --dest $folder/unpacked $folder/*.whl
content=$(echo $folder/unpacked/*)
info=$(basename "$content"/*.dist-info)
mkdir -p "$content/${info%.dist-info}.data/scripts"
install -m 755 "target/$profile/grade" "target/$profile/simulate" "$content/${info%.dist-info}.data/scripts"
$tools/bin/wheel pack --dest-dir $folder "$content" >/dev/null
ls -l $folder/*.whl | awk '{ printf "    %s, %.1f MB\n", $9, $5 / 1e6 }'

# With what the wheel needs, and a program to be graded.
try=$PWD/$folder/try
rm -rf "$try"
mkdir -p "$try/dist" "$try/my-program"
cp $folder/*.whl "$try/dist"
$tools/bin/pip download --quiet --only-binary :all: --dest "$try/dist" 'numpy>=1.22'
cp grader/selftest/src/programs/student.py "$try/my-program"
cat >"$try/my-program/submission.toml" <<'END'
run = ["python3", "-S", "-E", "{folder}/student.py", "{scene}", "-o", "{trace}"]
format = "csv"
END
cat >"$try/try" <<'END'
set -euo pipefail
cd "$(dirname "$0")"
command -v cc cargo || echo "    no compiler, no cargo"
began=$(date +%s)
python3 -m venv environment
environment/bin/pip install --quiet --no-index --find-links dist dist/spring_oracle-*.whl
export PATH=$PWD/environment/bin:$PATH
grade my-program --assignment t1m3 --no-progress >report
seconds=$(($(date +%s) - began))
grep -aE "Score|All required" report
echo "    verdict $seconds s after the start of the installation"
[ "$seconds" -lt 60 ]
python3 -c "import spring_oracle; print(spring_oracle.__name__, spring_oracle.__version__, 'imported')"
grade --version
simulate --version
END
if [ "$(id -u)" = 0 ] && command -v debootstrap >/dev/null; then
    root=$PWD/$folder/root
    release=$(. /etc/os-release && echo "$VERSION_CODENAME")
    [ -d "$root/usr" ] || debootstrap --variant=minbase --include=python3-venv "$release" "$root" >$folder/log
    rm -rf --one-file-system "${root:?}/try"
    cp -r "$try" "$root/try"
    echo "+ pip install, grade my-program    (in a root of Debian with Python alone)"
    # The mounts end with the process.
    unshare --mount --pid --fork --net bash -c 'mount -t proc proc "$0/proc" && mount -t devtmpfs none "$0/dev" && exec chroot "$0" \
        env -i HOME=/root PATH=/usr/bin:/bin bash /try/try' "$root"
else
    empty=$(mktemp -d)
    trap 'rm -rf "$empty"' EXIT
    cp -r "$try/." "$empty"
    echo "+ pip install, grade my-program    (in an empty folder)"
    env -i HOME="$empty" PATH=/usr/bin:/bin bash "$empty/try"
fi
echo "wheel: passed"
