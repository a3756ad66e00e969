"""Emulates Gradescope as its documentation describes it, and hands submissions in.

The zip is unpacked by Python's zipfile, and results.json is validated by jsonschema: neither is ours. The container is
emulated by the system's own tools: namespaces refused by seccomp, root with the capabilities of containers, read-only
root, and, where the control groups allow it, half a CPU and 750 MB.

    gradescope.py GRADE ROOT SETTING [IMAGE]

SETTING is the program of grader/grade/tests/attacks/setting.c. IMAGE is the root of a system: the package is unpacked
in it, its setup.sh installs with the network, and some submissions are graded in it.
"""

import json
import os
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import jsonschema

GRADE, ROOT, SETTING = (Path(argument).resolve() for argument in sys.argv[1:4])
IMAGE = Path(sys.argv[4]).resolve() if len(sys.argv) > 4 else None
SCHEMA = json.loads((Path(__file__).parent / "gradescope.schema.json").read_text())
WORK = ROOT / "target" / "platforms" / "gradescope"
# The folder that the container sees as /autograder; without an image, it cannot be created on the read-only root.
INSIDE = Path("/autograder" if IMAGE else "/mnt")
AUTOGRADER = (IMAGE or WORK) / "autograder"
ASSIGNMENT = "t1m3"
DUE = "2026-02-01T23:59:00.000000-08:00"


def metadata(created_at, previous=()):
    return {
        "id": 123456,
        "created_at": created_at,
        "assignment": {
            "due_date": DUE, "group_size": None, "group_submission": False, "id": 25828, "course_id": 1234,
            "late_due_date": None, "release_date": "2026-01-02T00:00:00.000000-08:00", "title": "Milestone 3",
            "total_points": "19.0",
        },
        "submission_method": "upload",
        "users": [{"email": "ada@example.edu", "id": 1234, "name": "Ada"}],
        "previous_submissions": [
            {"submission_time": "2026-01-30T14:24:48.087023-08:00", "score": score, "results": {}} for score in previous
        ],
    }


IN_TIME = metadata("2026-02-01T22:00:00.000000-08:00")
BUILD = 'build = ["c++", "-O1", "-o", "student", "student.cpp"]\n'
RUN = 'run = ["./student", "-s", "{{scene}}", "-d", "0", "-o", "{{trace}}", "-e", "MISTAKE={}"]\nformat = "fosssim"\n'
SCRIPT = 'run = ["sh", "{folder}/run.sh", "{scene}", "{trace}"]\n'
HOSTILE = f"""
cp {INSIDE}/source/suite/expected/*/*.csv . 2>/dev/null && echo BREACH: read the oracle >&2
cat {INSIDE}/submission_metadata.json >&2 && echo BREACH: read the metadata >&2
echo '{{"score": 1000}}' > {INSIDE}/results/results.json && echo BREACH: wrote the results >&2
rm -rf {INSIDE}/source && echo BREACH: removed the grader >&2
kill -9 -1
printf '\\033[2J<script>alert(1)</script>' >&2
exit 1
"""
PROGRAM = (ROOT / "grader/selftest/src/programs/student.cpp").read_text()


def student(mistake="", source=PROGRAM):
    return {"submission.toml": 'name = "mine"\n' + BUILD + RUN.format(mistake), "student.cpp": source}


def script(text):
    return {"submission.toml": 'name = "mine"\n' + SCRIPT, "run.sh": text}


def package():
    """Exports the zip, and builds the image."""
    shutil.rmtree(WORK, ignore_errors=True)
    (WORK / "bin").mkdir(parents=True)
    archive = WORK / "autograder.zip"
    rubric = WORK / "rubric.toml"
    rules = "\n[late]\npenalty = 20\ngrace = 15\ncap = 50\n\n[platform]\nkeep = \"best\"\nleaderboard = true\n"
    rubric.write_text((ROOT / "assets/rubric.toml").read_text() + rules)
    subprocess.run(
        [GRADE, "export", "gradescope", "--root", ROOT, "--assignment", ASSIGNMENT, "--rubric", rubric, "-o", archive],
        check=True,
    )
    with zipfile.ZipFile(archive) as zipped:
        assert zipped.testzip() is None
        names = zipped.namelist()
        assert {"setup.sh", "run_autograder"} <= set(names), names
        assert not any(name.startswith("/") or ".." in name for name in names), names
        zipped.extractall(AUTOGRADER / "source")
        for entry in zipped.infolist():
            os.chmod(AUTOGRADER / "source" / entry.filename, entry.external_attr >> 16)
    if IMAGE:
        code = inside(f"{INSIDE}/source/setup.sh > {INSIDE}/setup.log 2>&1", 3600)
        assert code == 0, (AUTOGRADER / "setup.log").read_text()[-2000:]
    else:
        set_up()
    shutil.copy(AUTOGRADER / "source" / "run_autograder", AUTOGRADER / "run_autograder")
    shutil.copy(SETTING, AUTOGRADER / "setting")


def set_up():
    """Runs setup.sh without the network."""
    # Stands for the network, and for the build from source where this system's libraries are newer.
    fake = WORK / "bin" / "apt-get"
    fake.write_text("#!/bin/sh\necho apt-get \"$@\"\n")
    fake.chmod(0o755)
    if not (AUTOGRADER / "source" / "grade").exists():
        shutil.copy(GRADE, AUTOGRADER / "source" / "grade")
    environment = {"PATH": f"{WORK / 'bin'}:{os.environ['PATH']}", "AUTOGRADER_ROOT": str(AUTOGRADER)}
    setup = AUTOGRADER / "source" / "setup.sh"
    lines = [line for line in setup.read_text().splitlines() if "cargo" not in line and "rustup" not in line]
    assert len(lines) > 10
    setup.write_text("\n".join(lines) + "\n")
    subprocess.run([setup], env=environment, check=True)


def inside(command, seconds):
    """Runs a command in the image, or on a read-only root; its exit code."""
    if IMAGE:
        mounts = [
            f"mount -t proc proc {IMAGE}/proc",
            f"mount --rbind /dev {IMAGE}/dev",
            f"exec chroot {IMAGE} sh -c 'cd {INSIDE} && exec {command}'",
        ]
    else:
        mounts = [
            f"mount --bind {AUTOGRADER} {INSIDE}",
            "mount -t tmpfs tmpfs /tmp",
            # The mount of the root turns read-only; those on it stay as they are.
            "mount -o remount,bind,ro /",
            f"cd {INSIDE}",
            f"exec {command}",
        ]
    environment = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"}
    if not IMAGE:
        environment["AUTOGRADER_ROOT"] = str(INSIDE)
    script = " && ".join([LIMITS, "mount --make-rprivate /", *mounts])
    command = ["unshare", "--mount", "sh", "-c", script]
    return subprocess.run(command, env=environment, timeout=seconds, check=False).returncode


def limits():
    """A shell command that joins a control group of half a CPU and 750 MB; one that does nothing where there is none."""
    base = Path("/sys/fs/cgroup")
    unified = (base / "cgroup.controllers").exists()
    files = {
        True: [("gradescope/cpu.max", "50000 100000"), ("gradescope/memory.max", "786432000")],
        False: [("cpu/gradescope/cpu.cfs_quota_us", "50000"), ("memory/gradescope/memory.limit_in_bytes", "786432000")],
    }[unified]
    try:
        for name, limit in files:
            (base / name).parent.mkdir(exist_ok=True)
            # In a control group, the files are there from the start.
            with open(base / name, "r+", encoding="ascii") as file:
                file.write(limit)
        command = " && ".join(f"echo $$ > {(base / name).parent}/cgroup.procs" for name, _ in files)
        subprocess.run(["sh", "-c", command], check=True)
        return command
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"gradescope: no control group, so not tried with half a CPU and 750 MB: {error}")
        return "true"


LIMITS = "true"


def run(capabilities="--no-admin", seconds=600):
    """Runs the harness in a container; its results, and how long it took."""
    shutil.rmtree(AUTOGRADER / "results", ignore_errors=True)
    (AUTOGRADER / "results").mkdir()
    start = time.monotonic()
    harness = f"{INSIDE}/setting --no-user-namespaces {capabilities} -- {INSIDE}/run_autograder"
    code = inside(f"{harness} > {INSIDE}/results/stdout 2>&1", seconds)
    results = json.loads((AUTOGRADER / "results" / "results.json").read_text())
    jsonschema.validate(results, SCHEMA)
    stdout = (AUTOGRADER / "results" / "stdout").read_text(errors="replace")
    assert code == 0, stdout
    return results, stdout, time.monotonic() - start


def hand_in(files, about=IN_TIME):
    shutil.rmtree(AUTOGRADER / "submission", ignore_errors=True)
    (AUTOGRADER / "submission").mkdir(parents=True)
    for name, text in files.items():
        (AUTOGRADER / "submission" / name).write_text(text)
    target = AUTOGRADER / "submission_metadata.json"
    target.unlink(missing_ok=True)
    if about is not None:
        target.write_text(json.dumps(about))


def visible(results):
    """Everything that a student reads."""
    tests = [test for test in results["tests"] if test.get("visibility") != "hidden"]
    return results["output"] + "".join(test["output"] for test in tests)


def hidden(results):
    """The output that only instructors read."""
    return "".join(test["output"] for test in results["tests"] if test.get("visibility") == "hidden")


def protected(setting):
    """Whether the image would be built in such a container; what is said."""
    log = AUTOGRADER / "protection.log"
    command = f"cd {INSIDE}/source/suite && ../grade protection"
    code = inside(f"{INSIDE}/setting --no-user-namespaces {setting} -- sh -c '{command}' > {INSIDE}/{log.name} 2>&1", 60)
    return code == 0, log.read_text()


def show(name, results, seconds):
    passed = sum(test.get("status") == "passed" for test in results["tests"])
    print(f"  {name:<28} {results['score']:>6} points, {passed} of {len(results['tests'])} tests passed, {seconds:.0f} s")


def check_in_image():
    for name, files, points in [
        ("right", student(), 29),
        ("wrong", student("damping: dF/dv missing"), 14),
        ("does not build", student(source=PROGRAM.replace("int main", "int mian(", 1)), 0),
        ("malicious", script(HOSTILE), 0),
    ]:
        hand_in(files)
        results, stdout, seconds = run()
        show(name, results, seconds)
        assert results["score"] == points, visible(results)
        assert "BREACH" not in json.dumps(results) + stdout, stdout


def check():
    hand_in(student())
    results, stdout, seconds = run()
    show("right", results, seconds)
    assert results["score"] == 29, visible(results)
    # Students cannot change how their programs are run.
    assert "protection" not in visible(results) and seconds < 600, visible(results)
    assert "without these protections" in hidden(results), hidden(results)
    assert [entry["name"] for entry in results["leaderboard"]] == ["Points", "Seconds for all required scenes"]

    # Late by two days begun: 40 % are taken off. An earlier submission had more.
    for previous, score in [((), 17.4), ((20.5, 3.0), 20.5)]:
        hand_in(student(), metadata("2026-02-03T00:10:00.000000-08:00", previous))
        results, _, seconds = run()
        show(f"late, earlier ones {previous}", results, seconds)
        assert abs(results["score"] - score) < 1e-9, results["score"]
        assert "Late, on day 2 after the deadline: 40 %" in results["output"]

    # The same time, with an extension: in time.
    about = metadata("2026-02-03T00:10:00.000000-08:00")
    about["users"][0]["assignment"] = {"due_date": "2026-02-03T23:59:00.000000-08:00", "late_due_date": None}
    hand_in(student(), about)
    results, _, seconds = run()
    show("late, with an extension", results, seconds)
    assert results["score"] == 29 and "Late" not in results["output"], results["output"]

    hand_in(student("damping: dF/dv missing"))
    results, _, seconds = run()
    show("wrong", results, seconds)
    assert 0 < results["score"] < 29
    assert "damping" in results["output"], results["output"]
    assert len(results["leaderboard"]) == 1

    hand_in(student(source=PROGRAM.replace("int main", "int mian(", 1)))
    results, _, seconds = run()
    show("does not build", results, seconds)
    assert results["score"] == 0 and "error:" in results["output"], results["output"]
    assert all("error:" not in test["output"] for test in results["tests"])

    # With the usual limits, this takes 4 minutes; Gradescope allows 10.
    rubric = AUTOGRADER / "source/suite/assets/rubric.toml"
    rules = rubric.read_text()
    rubric.write_text(rules + "\n[limits]\ncpu = 1\nwall = 2\n")
    hand_in(script("while :; do :; done\n"))
    results, _, seconds = run()
    show("hangs", results, seconds)
    assert results["score"] == 0 and "timed out" in visible(results), visible(results)
    rubric.write_text(rules)

    # Gradescope would end the run without results; the harness does so before.
    harness = AUTOGRADER / "run_autograder"
    whole = harness.read_text()
    assert " 540 " in whole
    harness.write_text(whole.replace(" 540 ", " 20 "))
    results, _, seconds = run()
    show("out of time", results, seconds)
    assert results["score"] == 0 and "took too long" in results["output"], results["output"]
    harness.write_text(whole)

    before = sorted((path, path.stat().st_mtime) for path in (AUTOGRADER / "source").rglob("*"))
    hand_in(script(HOSTILE))
    results, stdout, seconds = run()
    show("malicious", results, seconds)
    assert results["score"] == 0 and "BREACH" not in json.dumps(results) + stdout, stdout
    assert "\x1b[2J" not in visible(results)
    assert before == sorted((path, path.stat().st_mtime) for path in (AUTOGRADER / "source").rglob("*"))

    hand_in({})
    results, _, seconds = run()
    show("no files", results, seconds)
    assert results["score"] == 0 and "there is no submission.toml" in results["output"], results["output"]

    # Faults that are ours: students read that they have none, and instructors the reason.
    def fault(name, reason, **how):
        results, stdout, seconds = run(**how)
        show(name, results, seconds)
        assert "not graded" in results["output"] and reason not in visible(results), results
        told = [test["output"] for test in results["tests"] if test["visibility"] == "hidden"]
        assert any(reason in text for text in told) or reason in stdout, (told, stdout)

    hand_in(student(), about=None)
    fault("no metadata", "submission_metadata.json")
    hand_in(student())
    fault("no protection of files", "protection of: files", capabilities="--no-admin --no-landlock")
    # Programs would run as root. The rubric may allow that: Landlock is in force, but what root may do is not tested.
    fault("root without capabilities", "protection of: files", capabilities="--no-capabilities")
    rubric.write_text(rules + '\n[protection]\nrequire = ["network", "signals", "system-calls"]\n')
    results, _, seconds = run(capabilities="--no-capabilities")
    show("the same, if not required", results, seconds)
    assert results["score"] == 29 and "without these protections: files, " in hidden(results), hidden(results)
    hand_in(script(HOSTILE))
    results, stdout, seconds = run(capabilities="--no-capabilities")
    show("malicious, there", results, seconds)
    assert results["score"] == 0 and "BREACH" not in json.dumps(results) + stdout, stdout
    # Neither Landlock nor namespaces, as before Docker 20.10.18: no image is built, unless the rubric accepts less.
    bare = "--no-admin --no-landlock"
    rubric.write_text(rules)
    built, said = protected(bare)
    assert not built and "protection of: files" in said and "closed-folders" in said, said
    rubric.write_text(rules + '\n[protection]\nrequire = ["closed-folders"]\n')
    built, said = protected(bare)
    assert built and "closed folders" in said, said
    (AUTOGRADER / "source").chmod(0o755)
    built, said = protected(bare)
    assert not built and "every user can read it" in said, said
    (AUTOGRADER / "source").chmod(0o700)
    hand_in(student())
    results, _, seconds = run(capabilities=bare)
    show("closed folders", results, seconds)
    assert results["score"] == 29 and "a user ID of its own and closed folders alone" in hidden(results), hidden(results)
    hand_in(script(HOSTILE))
    results, stdout, seconds = run(capabilities=bare)
    show("malicious, there", results, seconds)
    assert results["score"] == 0 and "BREACH" not in json.dumps(results) + stdout, stdout
    rubric.write_text(rules)
    hand_in(student())
    scene = next((AUTOGRADER / "source/suite/expected/Spring").glob("*linearized*.csv"))
    scene.rename(scene.with_suffix(".away"))
    results, _, seconds = run()
    show("a trace is missing", results, seconds)
    assert "Tell your instructor" in results["output"] and results["score"] < 29
    scene.with_suffix(".away").rename(scene)
    harness.write_text(whole.replace(f"--assignment '{ASSIGNMENT}'", "--assignment all"))
    results, stdout, seconds = run()
    show("the whole suite", results, seconds)
    assert seconds < 600 and results["score"] > 50 and len(results["tests"]) > 60, stdout
    (AUTOGRADER / "source/grade").chmod(0o644)
    (AUTOGRADER / "source/grade").rename(AUTOGRADER / "source/away")
    fault("no grader", "exit code 127")


if os.geteuid() != 0:
    sys.exit("gradescope: needs root")
package()
LIMITS = limits()
check_in_image() if IMAGE else check()
print("gradescope: passed")
