"""Grades the repository of a student in Classroom 50. Written by `grade export classroom50`.

Students never get this folder, but whoever finds its address on GitHub Pages can read it: it holds no hidden scenes.
"""

import datetime
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
GRADE = FOLDER / "grade"
SCRATCH = Path(tempfile.mkdtemp())
POINTS = SCRATCH / "points.json"
RESULT = Path("result.json")

# A student's own, which may be a link or a folder.
if RESULT.is_dir() and not RESULT.is_symlink():
    shutil.rmtree(RESULT)
RESULT.unlink(missing_ok=True)
GRADE.chmod(0o755)
reports = ["--report", "text", "--report", "github", "--report", f"classroom50={POINTS}"]
ended = subprocess.run(
    [GRADE, ".", "--root", FOLDER / "suite", "--assignment", ASSIGNMENT_NAME, "--no-progress", *reports], check=False
)
if ended.returncode not in (0, 1):
    sys.exit(f"grade ended with exit code {ended.returncode}")

now = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
environment = os.environ
result = {
    "schema": "classroom50/result/v1",
    "classroom": environment["CLASSROOM"],
    "assignment": environment["ASSIGNMENT"],
    "assignment_type": environment.get("ASSIGNMENT_TYPE", "individual"),
    "owner": environment.get("OWNER") or environment["USERNAME"],
    "submission": environment["SUBMISSION_TAG"],
    "commit": environment["COMMIT_URL"],
    "release": environment["RELEASE_URL"],
    "review": environment.get("REVIEW_URL") or environment["COMMIT_URL"],
    # The runner puts the time of the commit in its place.
    "datetime": now,
} | json.loads(POINTS.read_text())
RESULT.write_text(json.dumps(result, indent=2))
shutil.rmtree(SCRATCH)
