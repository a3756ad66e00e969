"""Tests of grading by the program `grade`: SPRING_ORACLE_GRADE, or on the PATH."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import spring_oracle as so
from spring_oracle.testing import assert_matches_oracle

ROOT = Path(__file__).resolve().parents[3]
GRADE = shutil.which(os.environ.get("SPRING_ORACLE_GRADE", "grade"))
needs_grade = pytest.mark.skipif(GRADE is None, reason="the program grade is not installed")


@pytest.fixture
def traces(tmp_path):
    """The oracle's traces of the scenes of springs, with one number changed."""
    folder = tmp_path / "traces"
    shutil.copytree(ROOT / "expected" / "Spring", folder / "Spring")
    return folder


def spoil(folder):
    path = sorted(folder.glob("Spring/*.csv"))[0]
    lines = path.read_text().splitlines()
    row = lines[-1].split(",")
    row[2] = repr(float(row[2]) + 1.0)
    path.write_text("\n".join([*lines[:-1], ",".join(row)]) + "\n")
    return f"Spring/{path.stem}"


@needs_grade
def test_traces_are_graded(traces):
    report = so.grade(traces, only=["Spring/*"], root=ROOT)
    assert report and not report.failed and len(report.scenes) > 5, report
    name = spoil(traces)
    report = so.grade(traces, only=["Spring/*"], root=ROOT)
    assert not report and [scene["name"] for scene in report.failed] == [name], report
    assert report.points[0] < report.points[1] and name in report._repr_html_() + str(report.scenes)
    with pytest.raises(AssertionError, match=name):
        assert_matches_oracle(traces, only=["Spring/*"], root=ROOT)


@needs_grade
def test_messages_of_grade_come_through(tmp_path):
    with pytest.raises(so.GradeError, match="nobody"):
        so.grade(tmp_path / "nobody", root=ROOT)
    with pytest.raises(so.GradeError, match="t9m9"):
        so.grade(ROOT / "expected", assignment="t9m9", root=ROOT)


@needs_grade
def test_a_time_out_is_said(traces):
    with pytest.raises(TimeoutError, match="stopped"):
        so.grade(traces, root=ROOT, timeout=0.001)


def test_a_missing_program_is_said(monkeypatch, tmp_path):
    monkeypatch.setenv("SPRING_ORACLE_GRADE", str(tmp_path / "grade"))
    with pytest.raises(so.GradeError, match="cargo install"):
        so.grade(tmp_path)


@needs_grade
def test_the_simulation_passes_the_comparison_with_the_oracle():
    for path in sorted((ROOT / "assets" / "Spring").glob("*.xml"))[:5]:
        scene = so.Scene.read(path, strict=True)
        oracle = so.load_trace(ROOT / "expected" / "Spring" / f"{path.stem}.csv", scene)
        trace = so.simulate(scene)
        assert np.array_equal(trace.positions, oracle.positions) and so.compare(trace, oracle), path
