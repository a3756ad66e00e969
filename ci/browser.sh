#!/usr/bin/env bash
# Opens the pages of `grade --html` and `simulate view` in Chromium: no console error, no request elsewhere, playback,
# keyboard, hostile text, accessibility, runs that blow up, requests of other sites, pictures of the pages. Installs
# Chromium, playwright-core and axe-core where it can, and says what it skips.
set -euo pipefail
cd "$(dirname "$0")/.."

skip() {
    echo "browser: skipped: $1"
    exit 0
}

command -v node >/dev/null && command -v npm >/dev/null || skip "node and npm are not installed"
if ! command -v chromium >/dev/null; then
    echo "+ apt-get install chromium"
    { apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium >/dev/null; } \
        || skip "Chromium could not be installed"
fi
tools=target/browser/tools
if [ ! -d "$tools/node_modules/axe-core" ] || [ ! -d "$tools/node_modules/playwright-core" ]; then
    echo "+ npm install playwright-core axe-core"
    mkdir -p "$tools"
    npm install --prefix "$tools" --no-audit --no-fund --silent playwright-core@1 axe-core@4 \
        || skip "playwright-core and axe-core could not be installed"
fi

echo "+ cargo build --release --bin grade --bin simulate"
cargo build --release --locked --quiet -p grade -p simulate --bin grade --bin simulate
NODE_PATH=$PWD/$tools/node_modules node ci/browser/check.cjs "$(command -v chromium)"
