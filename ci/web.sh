#!/usr/bin/env bash
# Builds the page that grades in a browser, target/web/index.html: `grade` as WebAssembly, with its scenes, in one file.
# Then tries it in Chromium, from file://. Needs wasi-libc and lld with Debian's compiler, or the target of rustup, and node.
#
#     ci/web.sh           builds and tries
#     ci/web.sh build     builds
set -euo pipefail
cd "$(dirname "$0")/.."
. ci/cross.sh

target=wasm32-wasip1
profile=${WEB_PROFILE:-release}
echo "+ cargo build --profile $profile --target $target --bin grade"
cross build $target --profile "$profile" --bin grade
program=target/$target/$profile/grade.wasm
[ -f "$program" ] || program=$CROSS_FOLDER/$target/$profile/grade.wasm
node web/build.cjs "$program" target/web/index.html
[ "${1:-}" != build ] || exit 0

tools=target/browser/tools
if ! command -v chromium >/dev/null || [ ! -d "$tools/node_modules/playwright-core" ]; then
    echo "web: not tried: Chromium or playwright-core is missing, which ci/browser.sh installs"
    exit 0
fi
NODE_PATH=$PWD/$tools/node_modules node ci/browser/web.cjs "$(command -v chromium)"
