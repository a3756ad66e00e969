"""Grades the workspace of a student in Codio, and sends the grade. Written by `grade export codio`.

Codio ends a script after three minutes, and takes at most 1 MB of feedback.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# Before packages that a student may have installed.
sys.path.insert(0, "/usr/share/codio/assessments")
from lib.grade import FORMAT_V2_TXT, send_grade_v2  # noqa: E402

FOLDER = Path(__file__).resolve().parent
WORKSPACE = FOLDER.parents[2]
SCRATCH = Path(tempfile.mkdtemp())
RESULTS = SCRATCH / "results.json"
# The exit code of `timeout` where the time ran out.
LATE = 124

# The submission must not contain the oracle, which lies in .guides.
away = lambda folder, names: {".guides", ".git"} & set(names) if Path(folder) == WORKSPACE else ()  # noqa: E731
shutil.copytree(WORKSPACE, SCRATCH / "submission", symlinks=True, ignore=away)
grade = FOLDER / "grade"
grade.chmod(0o755)
ended = subprocess.run(
    ["timeout", "--signal=TERM", "--kill-after=10", "SECONDS_OF_RUN", grade, SCRATCH / "submission",
     "--root", FOLDER / "suite", ARGUMENTS, "--no-progress", "--report", "text", "--report", f"prairielearn={RESULTS}"],
    check=False,
)
# A script that fails is an attempt without a grade, and Codio writes to the instructor.
if ended.returncode not in (0, 1, LATE) or not RESULTS.exists():
    sys.exit(f"grade ended with exit code {ended.returncode}")

results = json.loads(RESULTS.read_text())
parts = [*results.get("format_errors", []), results["message"], results["output"]]
for test in results["tests"]:
    most = f"/{test['max_points']:g}" if test["max_points"] else " extra"
    parts.append(f"[{test['points']:g}{most}] {test['name']}: {test['message']}\n{test['output']}")
feedback = "\n".join(part.rstrip() for part in parts if part)
shutil.rmtree(SCRATCH)
sys.exit(0 if send_grade_v2(round(100 * results["score"]), feedback, FORMAT_V2_TXT) else 1)
