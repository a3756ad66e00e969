"""Grading by the program `grade`, run as a subprocess.

Not by a library: the sandbox forks, starts and confines programs, which is safe in a separate process with one thread, and not
within an interpreter. The report is the program's own, as JSON.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Iterable, Sequence


class GradeError(RuntimeError):
    """`grade` could not be run, or refused its arguments. The message is its own."""


def _program(grade: str | os.PathLike | None) -> str:
    given = grade or os.environ.get("SPRING_ORACLE_GRADE")
    # A wheel may bring the program, in the interpreter's folder.
    found = shutil.which(os.fspath(given or "grade")) or (None if given else shutil.which("grade", path=os.path.dirname(sys.executable)))
    if found is None:
        where = f"{given} is not a program" if given else "the program grade is not on the PATH"
        raise GradeError(f"{where}: cargo install --path grader/grade, or give its path as grade=… or in SPRING_ORACLE_GRADE")
    return found


def _run(arguments: Sequence[str], timeout: float | None, root: str | os.PathLike | None) -> subprocess.CompletedProcess:
    try:
        return subprocess.run(arguments, capture_output=True, text=True, timeout=timeout, cwd=root)
    except subprocess.TimeoutExpired:
        raise TimeoutError(f"grade did not end within {timeout:g} s; it was stopped") from None


@dataclass(frozen=True)
class GradeReport:
    """The grading of one submission. It is true if all required features passed."""

    data: dict[str, Any]
    """The report as `docs/report.schema.json` describes it."""

    @property
    def outcome(self) -> str:
        """`passed`, `passed-shipped`, `failed` or `grader-fault`."""
        return self.data["outcome"]

    @property
    def points(self) -> tuple[float | None, float]:
        """Points earned of the required features, and how many there are."""
        required = self.data["required"]
        return required.get("points_earned"), required["points"]

    @property
    def findings(self) -> list[dict[str, Any]]:
        """The findings, in the order in which to read them: kind, message, evidence, scenes."""
        return self.data["findings"]

    @property
    def scenes(self) -> list[dict[str, Any]]:
        """Each scene: name, verdict, message, feature, first wrong number."""
        rows = ((feature, scene) for feature in self.data["features"] for scene in feature["scenes"])
        return [
            {
                "section": feature["section"],
                "feature": f"{feature['group']}, {feature['integrator']}",
                **{key: scene.get(key) for key in ("name", "verdict", "message", "first_wrong")},
            }
            for feature, scene in rows
        ]

    @property
    def failed(self) -> list[dict[str, Any]]:
        """The scenes that did not pass."""
        return [scene for scene in self.scenes if scene["verdict"] != "pass"]

    def __bool__(self) -> bool:
        return self.outcome in ("passed", "passed-shipped")

    def __repr__(self) -> str:
        earned, points = self.points
        scenes = self.scenes
        text = f"{Path(self.data['submission']).name}: {self.outcome}, "
        text += f"{'no' if earned is None else f'{earned:g}'} of {points:g} points, {len(scenes) - len(self.failed)} of {len(scenes)} scenes"
        return "\n".join([text, *(f"  {finding['message']}" for finding in self.findings)])

    def to_pandas(self) -> Any:
        """A table of the scenes."""
        import pandas

        return pandas.DataFrame(self.scenes).drop(columns="first_wrong")

    def _repr_html_(self) -> str:
        from . import _html

        verdict = "correct" if self else "inconclusive" if self.outcome == "grader-fault" else "wrong"
        rows = [(of["section"], f"{of['group']}, {of['integrator']}", self._passed(of)) for of in self.data["features"]]
        return _html.block(verdict, repr(self)) + _html.table(rows, ("", "feature", "scenes passed"))

    @staticmethod
    def _passed(feature: dict[str, Any]) -> str:
        passed = sum(scene["verdict"] == "pass" for scene in feature["scenes"])
        return f"{passed} of {len(feature['scenes'])}"


def _options(assignment: str | None, only: Iterable[str], unprotected: bool) -> list[str]:
    options = ["--assignment", assignment] if assignment else []
    options += [argument for pattern in only for argument in ("--only", pattern)]
    return [*options, "--unprotected"] if unprotected else options


def grade(
    submission: str | os.PathLike, assignment: str | None = None, *, only: Iterable[str] = (), unprotected: bool = False,
    root: str | os.PathLike | None = None, timeout: float | None = None, grade: str | os.PathLike | None = None,
) -> GradeReport:  # fmt: skip
    """Grades a program, a folder with submission.toml, or a folder of traces, by the program `grade`.

    `only` names scenes, groups or patterns. `root` is the folder with `assets/` and `expected/`; without it, the scenes that come with
    the program. The program runs in the sandbox, unless `unprotected`. Raises `GradeError` with the program's message, or `TimeoutError`.
    """
    program = _program(grade)
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder, "report.json")
        arguments = [program, os.path.abspath(submission), "--report", f"json={report}", "--no-progress", "--no-jacobians"]
        ended = _run(arguments + _options(assignment, only, unprotected), timeout, root)
        # 0: passed, 1: failed, 3: a fault, of which the report says the reason.
        if not report.exists():
            raise GradeError(ended.stderr.strip() or f"grade ended with status {ended.returncode}")
        return GradeReport(json.loads(report.read_text()))


@dataclass(frozen=True)
class ClassReport:
    """The gradings of a class."""

    rows: list[dict[str, str]]
    """The table summary.csv, a row a submission."""
    reports: dict[str, GradeReport]
    """The report of each submission."""

    def __len__(self) -> int:
        return len(self.rows)

    def to_pandas(self) -> Any:
        """The table as a data frame."""
        import io

        import pandas

        text = io.StringIO()
        writer = csv.DictWriter(text, self.rows[0] if self.rows else [])
        writer.writeheader()
        writer.writerows(self.rows)
        text.seek(0)
        return pandas.read_csv(text)

    def _repr_html_(self) -> str:
        from . import _html

        return _html.table((row.values() for row in self.rows), list(self.rows[0]) if self.rows else ())


def grade_class(
    folder: str | os.PathLike, assignment: str | None = None, *, unprotected: bool = False,
    root: str | os.PathLike | None = None, timeout: float | None = None, grade: str | os.PathLike | None = None,
) -> ClassReport:  # fmt: skip
    """Grades every submission in a folder, as `grade class` does. Arguments as of `grade`."""
    program = _program(grade)
    with tempfile.TemporaryDirectory() as output:
        arguments = [program, "class", os.path.abspath(folder), "--output", output, "--format", "json"]
        ended = _run(arguments + _options(assignment, (), unprotected), timeout, root)
        summary = Path(output, "summary.csv")
        if not summary.exists():
            raise GradeError(ended.stderr.strip() or f"grade class ended with status {ended.returncode}")
        with summary.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
        reports = {path.stem: GradeReport(json.loads(path.read_text())) for path in sorted(Path(output, "reports").glob("*.json"))}
    return ClassReport(rows, reports)
