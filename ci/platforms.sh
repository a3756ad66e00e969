#!/usr/bin/env bash
# Emulates course platforms as their documentation describes them, and hands submissions in: right, wrong, not building,
# late, hanging, malicious. Results are validated by jsonschema, reports and workflows by the schemas of the platforms.
# Says what it skips.
set -euo pipefail
cd "$(dirname "$0")/.."
# shellcheck source=ci/platforms/prepare.sh
. ci/platforms/prepare.sh

for platform in gradescope prairielearn github schemas; do
    echo "+ ci/platforms/$platform.py"
    "$python" "ci/platforms/$platform.py" target/release/grade . "$setting"
done
echo "platforms: passed"
