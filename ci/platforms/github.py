"""Emulates a step of GitHub Actions as its documentation describes it, and grades submissions in it.

Commands are read as the runner reads them: one a line, white space before them ignored, none between `stop-commands` and
its token. The points of Classroom 50 are validated by jsonschema, and the workflow is read by PyYAML: neither is ours.

    github.py GRADE ROOT SETTING       SETTING is not used
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import jsonschema
import yaml

GRADE, ROOT = (Path(argument).resolve() for argument in sys.argv[1:3])
WORK = ROOT / "target" / "platforms" / "github"
COUNT = {"type": "integer", "minimum": 0}
SCHEMA = {
    "type": "object",
    "required": ["score", "max-score", "tests"],
    "properties": {
        "score": COUNT,
        "max-score": COUNT,
        "tests": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["test-name", "passed", "score", "max-score"],
                "properties": {
                    "test-name": {"type": "string", "minLength": 1},
                    "passed": {"type": "boolean"},
                    "score": COUNT,
                    "max-score": COUNT,
                },
            },
        },
    },
}
PROGRAM = (ROOT / "grader/selftest/src/programs/student.cpp").read_text()
BUILD = 'build = ["c++", "-O1", "-o", "student", "student.cpp"]\n'
RUN = 'run = ["./student", "-s", "{{scene}}", "-d", "0", "-o", "{{trace}}", "-e", "MISTAKE={}"]\nformat = "fosssim"\n'
HOSTILE = """
for stream in 1 2; do
    printf '\\n::error title=BREACH::x\\n  ::set-output name=result::BREACH\\n::stop-commands::x\\n```\\n<h1>BREACH</h1>\\n' >&$stream
done
echo result=BREACH >> "$GITHUB_OUTPUT"
exit 1
"""


def commands(stdout):
    """The commands that the runner obeys: name, properties, message."""
    found, token = [], None
    for line in stdout.splitlines():
        match = re.match(r"^\s*::([\w-]+)(?: ([^:]*))?::(.*)$", line)
        if token is not None:
            if line.strip() == f"::{token}::":
                token = None
        elif match and match[1] == "stop-commands":
            token = match[3]
        elif match:
            properties = dict(part.split("=", 1) for part in (match[2] or "").split(",") if part)
            found.append((match[1], properties, match[3]))
    assert token is None, "commands stay off"
    return found


def step(files, *arguments):
    """Grades a submission in a step: exit code, commands, summary, points; None for points if it was not graded."""
    shutil.rmtree(WORK, ignore_errors=True)
    (WORK / "submission").mkdir(parents=True)
    for name, text in files.items():
        (WORK / "submission" / name).write_text(text)
    summary, file = WORK / "summary.md", WORK / "points.json"
    summary.write_text("before\n")
    environment = os.environ | {
        "GITHUB_ACTIONS": "true", "CI": "true", "GITHUB_STEP_SUMMARY": str(summary),
    }
    reports = ["--report", "text", "--report", "github", "--report", f"classroom50={file}"]
    command = [GRADE, ".", "--root", ROOT, "--assignment", "t1m3", *reports, *arguments]
    ended = subprocess.run(
        command, cwd=WORK / "submission", env=environment, text=True, errors="replace", check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )
    points = json.loads(file.read_text()) if file.exists() else None
    if points:
        jsonschema.validate(points, SCHEMA)
        assert all(points[name] == sum(test[name] for test in points["tests"]) for name in ("score", "max-score"))
        assert all(test["score"] <= test["max-score"] for test in points["tests"])
    text = summary.read_text()
    assert text.startswith("before\n## Spring Oracle\n") and len(text.encode()) < 1 << 20
    print(f"  exit code {ended.returncode}, {points and points['score']} hundredths of a point,"
          f" {len(commands(ended.stdout))} annotations")
    return ended.returncode, commands(ended.stdout), text, points


def student(mistake="", source=PROGRAM):
    return {"submission.toml": 'name = "mine"\n' + BUILD + RUN.format(mistake), "student.cpp": source}


def markup(summary):
    """The summary outside of its fenced blocks."""
    kept, fence = [], None
    for line in summary.splitlines():
        if fence:
            fence = None if line == fence else fence
        elif line.startswith("```"):
            fence = line.removesuffix("text")
        else:
            kept.append(line)
    assert fence is None
    return "\n".join(kept)


def check():
    code, annotations, summary, points = step(student())
    assert code == 0 and annotations == [] and points["score"] == points["max-score"] == 2900
    assert all(test["passed"] for test in points["tests"])
    assert "| SpringDamping / linearized-implicit-euler | " in summary

    code, annotations, summary, points = step(student("damping: dF/dv missing"))
    assert code == 1 and 0 < points["score"] < 2900
    # The proven cause is in the annotation.
    assert any(name == "error" and "SpringDamping" in about["title"] and "dF/dv" in message for name, about, message in annotations), annotations
    assert "damping" in summary

    code, annotations, _, points = step(student(source=PROGRAM.replace("int main", "int 5main", 1)))
    row = 1 + PROGRAM[: PROGRAM.index("int main")].count("\n")
    places = [(about.get("file"), about.get("line")) for name, about, _ in annotations if name == "error"]
    assert code == 1 and ("student.cpp", str(row)) in places, annotations
    assert points["score"] == 0
    assert sum(name == "error" for name, _, _ in annotations) <= 10

    hostile = {"submission.toml": 'name = "::error::BREACH"\nrun = ["sh", "{folder}/run.sh", "{scene}", "{trace}"]\n', "run.sh": HOSTILE}
    code, annotations, summary, points = step(hostile)
    assert code == 1 and "BREACH" not in repr(annotations) + json.dumps(points), annotations
    assert "BREACH" in summary and "BREACH" not in markup(summary), summary

    endless = {"submission.toml": hostile["submission.toml"], "run.sh": "while :; do :; done\n"}
    code, annotations, summary, points = step(endless, "--limit", "cpu=1", "--limit", "wall=2")
    assert code == 1 and points["score"] == 0 and "timed out" in summary, summary

    code, annotations, summary, points = step({})
    assert code == 1 and "submission.toml" in summary and points["score"] == 0

    code, annotations, summary, points = step(student(), "--expected", "/nowhere")
    assert code == 2 and annotations[0][1]["title"] == "Not graded" and points is None
    assert "/nowhere" in summary


def workflow():
    folder = WORK / "template"
    subprocess.run(
        [GRADE, "export", "github", "--root", ROOT, "--assignment", "t1m3", "--repository", "course/spring-oracle", "-o", folder],
        check=True,
    )
    document = yaml.safe_load((folder / ".github/workflows/grade.yml").read_text())
    steps = document["jobs"]["grade"]["steps"]
    checkouts = [step["with"] for step in steps if step.get("uses", "").startswith("actions/checkout@")]
    assert all(about["persist-credentials"] is False for about in checkouts) and len(checkouts) == 2
    assert checkouts[0]["repository"] == "course/spring-oracle" and checkouts[0]["ref"] == "main"
    # No cargo in the folder of the submission, whose configuration it would obey.
    built = [place for place, step in enumerate(steps) if "cargo" in step.get("run", "")]
    assert max(built) < next(place for place, step in enumerate(steps) if step.get("with") == checkouts[1])
    graded = steps[-1]
    assert graded["env"] == {"ASSIGNMENT": "t1m3"} and "--report github" in graded["run"]


check()
workflow()
print("github: passed")
