"""Checks reports and workflows by the schemas of those who read them: Jenkins, GitHub, PrairieLearn.

    schemas.py GRADE ROOT SETTING       SETTING is not used

- JUnit: Jenkins' `junit-10.xsd`, which the source of pytest carries, by the package xmlschema.
- Workflows: action-validator, an npm package.
- PrairieLearn: its own schema of a question, if PRAIRIELEARN is the folder of its source; no registry has it.
"""

import json
import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import jsonschema
import xmlschema
import yaml

GRADE, ROOT = (Path(argument).resolve() for argument in sys.argv[1:3])
WORK = ROOT / "target" / "platforms" / "schemas"
PYTEST = "pytest-8.3.4"
XSD = f"{PYTEST}/testing/example_scripts/junit-10.xsd"
VALIDATOR = "@action-validator/cli@0.6.0"


def grade(*arguments):
    ended = subprocess.run([GRADE, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode in (0, 1), ended.stderr
    return ended.stdout


def jenkins():
    """The schema of Jenkins; None if it cannot be had."""
    if not (WORK / XSD).exists():
        name = PYTEST.replace("-", "==")
        download = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", "pytest", "-d", WORK, name]
        if subprocess.run(download, check=False).returncode:
            return None
        with tarfile.open(WORK / f"{PYTEST}.tar.gz") as archive:
            archive.extract(XSD, WORK)
    return xmlschema.XMLSchema(WORK / XSD)


def junit():
    schema = jenkins()
    if schema is None:
        return print("  JUnit: skipped: the source of pytest could not be downloaded")
    traces = WORK / "traces"
    shutil.copytree(ROOT / "expected", traces, dirs_exist_ok=True)
    # One trace is wrong, one malformed, one missing.
    wrong, malformed, missing = sorted(traces.glob("Spring/*.csv"))[:3]
    wrong.write_text(wrong.read_text().replace("1", "2"))
    malformed.write_text("<&>\x01\n")
    missing.unlink()
    for arguments in [
        ["--format", "junit"],
        ["--traces", traces, "--format", "junit"],
        ["jacobians", "--force", "springforce", "--format", "junit"],
    ]:
        report = WORK / "report.xml"
        report.write_text(grade(*arguments))
        schema.validate(report)
        print(f"  JUnit: {report.stat().st_size} bytes of grade {arguments[0]} are valid for Jenkins")


def pipelines():
    template = WORK / "template"
    for host in ["github", "gitlab"]:
        grade("export", host, "--assignment", "t1m3", "--repository", "course/spring-oracle", "-o", template)
    job = yaml.safe_load((template / ".gitlab-ci.yml").read_text())["grade"]
    assert job["artifacts"]["reports"] == {"junit": "report.xml"} and job["timeout"] == "30 minutes"
    assert all(isinstance(line, str) for line in job["script"])
    if not shutil.which("npx"):
        return print("  workflows: skipped: npm is not installed")
    workflows = [*template.glob(".github/workflows/*.yml"), *ROOT.glob(".github/workflows/*.yml")]
    for workflow in workflows:
        # The validator's schema is older than this permission.
        checked = WORK / workflow.name
        checked.write_text(workflow.read_text().replace("      attestations: write\n", ""))
        ended = subprocess.run(["npx", "--yes", VALIDATOR, checked], cwd=WORK, capture_output=True, text=True, check=False)
        if ended.returncode and "npm error" in ended.stderr:
            return print(f"  workflows: skipped: {VALIDATOR} could not be installed")
        assert ended.returncode == 0, ended.stdout + ended.stderr
        print(f"  workflows: {workflow.relative_to(ROOT)} is valid")


def prairielearn():
    if "PRAIRIELEARN" not in os.environ:
        return print("  PrairieLearn: skipped: PRAIRIELEARN does not name its source")
    schemas = Path(os.environ["PRAIRIELEARN"]) / "apps/prairielearn/src/schemas/schemas"
    schema = json.loads((schemas / "infoQuestion.json").read_text())
    info = next((ROOT / "target/platforms/prairielearn/course/questions").glob("*/info.json"))
    jsonschema.validate(json.loads(info.read_text()), schema)
    print("  PrairieLearn: info.json is valid")


shutil.rmtree(WORK / "template", ignore_errors=True)
WORK.mkdir(parents=True, exist_ok=True)
junit()
pipelines()
prairielearn()
print("schemas: passed")
