#!/usr/bin/env bash
# Packages for users who have no Rust toolchain: target/package/spring-oracle-VERSION-TARGET.tar.gz (.zip for Windows) with
# both programs, its SHA-256, and the list of the packages in it (ci/sbom.py). Then tries the archive: unpacked into an empty
# folder, its grade grades its simulate by the scenes that it brings. An archive for Arm is tried under qemu, one for Windows
# under Wine by ci/windows.sh.
#
#     ci/package.sh            for this machine
#     ci/package.sh TARGET     for another one, such as aarch64-unknown-linux-gnu or x86_64-pc-windows-gnu (ci/cross.sh)
set -euo pipefail
cd "$(dirname "$0")/.."
. ci/cross.sh

host=$(rustc -vV | sed -n 's/^host: //p')
target=${1:-$host}
profile=${PACKAGE_PROFILE:-dist}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
name=spring-oracle-$version-$target
folder=target/package/$name
ending=
[[ $target != *-windows-* ]] || ending=.exe

echo "+ cargo build --profile $profile --target $target"
cross build "$target" --profile "$profile" --bin grade --bin simulate
built=target/$target/$profile
[ -x "$built/grade$ending" ] || built=$CROSS_FOLDER/$target/$profile
rm -rf "$folder"
mkdir -p "$folder"
cp "$built/grade$ending" "$built/simulate$ending" README.md CHANGELOG.md LICENSE-* "$folder"
# The same bytes from the same programs: names in order, no owner, the time of the commit.
time=$(git log -1 --format=%ct)
if [ -n "$ending" ]; then
    archive=$name.zip
    rm -f "target/package/$archive"
    find "$folder" -exec touch -d "@$time" {} +
    (cd target/package && find "$name" -type f | sort | TZ=UTC zip -qX9 "$archive" -@)
else
    archive=$name.tar.gz
    tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$time" -C target/package -cf - "$name" \
        | gzip -n9 >"target/package/$archive"
fi
python3 ci/sbom.py "$target" >"target/package/$name.cdx.json"
(cd target/package && sha256sum "$archive" | tee "$archive.sha256")
ls -l "target/package/$archive" | awk '{ printf "    %.1f MB\n", $5 / 1e6 }'
runner=()
case $target in
"$host") ;;
aarch64-unknown-linux-gnu) runner=(qemu-aarch64 -L /usr/aarch64-linux-gnu) ;;
*) exit 0 ;;
esac

empty=$(mktemp -d)
trap 'rm -rf "$empty"' EXIT
tar -xzf "target/package/$archive" -C "$empty"
cd "$empty/$name"
if [ "$target" = "$host" ]; then
    echo "+ ./grade ./simulate    (in an empty folder)"
    ./grade ./simulate >"$empty/report"
else
    echo "+ ${runner[*]} ./grade    (in an empty folder)"
    "${runner[@]}" ./grade >"$empty/report"
fi
grep -aE "Required|Score|All passed" "$empty/report"
"${runner[@]}" ./grade --version
echo "package: passed"
