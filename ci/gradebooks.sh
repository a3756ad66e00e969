#!/usr/bin/env bash
# Reads the gradebooks of a class with LibreOffice; installs it if it can.
set -euo pipefail
cd "$(dirname "$0")/.."

if ! command -v soffice >/dev/null; then
    echo "+ apt-get install libreoffice-calc"
    if ! { apt-get update -qq && apt-get install -y -qq --no-install-recommends libreoffice-calc >/dev/null; }; then
        echo "gradebooks: skipped: LibreOffice could not be installed"
        exit 0
    fi
fi
cargo test --release --locked --quiet gradebooks::
echo "gradebooks: passed"
