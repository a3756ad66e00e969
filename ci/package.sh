#!/usr/bin/env bash
# Packages for users who have no Rust toolchain: target/package/spring-oracle-VERSION-TARGET.tar.gz with both programs,
# and its SHA-256. Then tries the archive: unpacked into an empty folder, its grade grades its simulate by the scenes that
# it brings.
#
#     ci/package.sh            for this machine
#     ci/package.sh TARGET     for a target of rustup, such as x86_64-unknown-linux-musl; it is tried only if it runs here
set -euo pipefail
cd "$(dirname "$0")/.."

host=$(rustc -vV | sed -n 's/^host: //p')
target=${1:-$host}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
name=spring-oracle-$version-$target
folder=target/package/$name

echo "+ cargo build --profile dist --target $target"
cargo build --locked --quiet --profile dist --target "$target" --bin grade --bin simulate
rm -rf "$folder"
mkdir -p "$folder"
cp "target/$target/dist/grade" "target/$target/dist/simulate" README.md CHANGELOG.md LICENSE-* "$folder"
# The same bytes from the same programs: names in order, no owner, the time of the commit.
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$(git log -1 --format=%ct)" \
    -C target/package -cf - "$name" | gzip -n9 >"$folder.tar.gz"
(cd target/package && sha256sum "$name.tar.gz" | tee "$name.tar.gz.sha256")
ls -l "$folder.tar.gz" | awk '{ printf "    %.1f MB\n", $5 / 1e6 }'
[ "$target" = "$host" ] || exit 0

empty=$(mktemp -d)
trap 'rm -rf "$empty"' EXIT
tar -xzf "$folder.tar.gz" -C "$empty"
cd "$empty/$name"
echo "+ ./grade ./simulate    (in an empty folder)"
./grade ./simulate >"$empty/report"
grep -aE "Required|Score|All passed" "$empty/report"
./grade --version
echo "package: passed"
