#!/usr/bin/env bash
# Builds the pages for a browser: target/web/index.html, `grade` as WebAssembly with its scenes, and playground.html, the
# simulator; one file each. Then tries them in Chromium, from file://. Needs wasi-libc and lld with Debian's compiler, or the target of rustup, and node.
#
#     ci/web.sh           builds and tries
#     ci/web.sh build     builds
set -euo pipefail
cd "$(dirname "$0")/.."
. ci/cross.sh

target=wasm32-wasip1
profile=${WEB_PROFILE:-web}
echo "+ cargo build --profile $profile --target $target --bin grade --lib -p grade -p playground"
cross build $target --profile "$profile" --bin grade --lib -p grade -p playground
built=target/$target/$profile
[ -f "$built/grade.wasm" ] || built=$CROSS_FOLDER/$target/$profile
node web/build.cjs target/web "$built/grade.wasm" "$built/playground.wasm"
[ "${1:-}" != build ] || exit 0
lines() { find "$@" -type f -print0 | xargs -0 cat | wc -l; }
crates=$(cargo tree --locked --edges normal --prefix none -p grade -p playground --format '{p}' | sed -n "s|.* ($PWD/\\([^)]*\\)).*|\\1/src|p" | sort -u | grep -v ^web/)
scripts=$(grep -oh '{{[a-z.]*}}' web/*.html | tr -d '{}' | sort -u | while read -r part; do ls simulator/picture/src/web/"$part" simulator/simulate/src/view/"$part" 2>/dev/null || true; done)
# shellcheck disable=SC2086
echo "web: $(lines web) lines of its own; of the programs $(lines $crates -name "*.rs") lines of Rust and $(lines $scripts) of scripts and styles"

tools=target/browser/tools
if ! command -v chromium >/dev/null || [ ! -d "$tools/node_modules/playwright-core" ]; then
    echo "web: not tried: Chromium or playwright-core is missing, which ci/browser.sh installs"
    exit 0
fi
NODE_PATH=$PWD/$tools/node_modules node ci/browser/web.cjs "$(command -v chromium)"
NODE_PATH=$PWD/$tools/node_modules node ci/browser/playground.cjs "$(command -v chromium)"
