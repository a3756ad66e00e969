"""Emulates PrairieLearn's external grader as its documentation describes it, and hands submissions in.

The course folder is read by Python's json and html.parser, results.json is validated by jsonschema, and the pictures are
decoded by zlib: none of these is ours. The container is emulated by namespaces refused by seccomp.

    prairielearn.py GRADE ROOT SETTING [IMAGE]

SETTING is the program of grader/grade/tests/attacks/setting.c. IMAGE is the root of a system with the packages of the
Dockerfile; submissions are graded in it, at PrairieLearn's paths.
"""

import base64
import json
import os
import shutil
import struct
import subprocess
import sys
import uuid
import zlib
from html.parser import HTMLParser
from pathlib import Path

import jsonschema

GRADE, ROOT, SETTING = (Path(argument).resolve() for argument in sys.argv[1:4])
IMAGE = Path(sys.argv[4]).resolve() if len(sys.argv) > 4 else None
SCHEMA = json.loads((Path(__file__).parent / "prairielearn.schema.json").read_text())
WORK = ROOT / "target" / "platforms" / "prairielearn"
COURSE, CONTAINER = WORK / "course", (IMAGE or WORK) / "grade"
# The folder as the container sees it.
INSIDE = Path("/grade") if IMAGE else CONTAINER
PROGRAM = (ROOT / "grader/selftest/src/programs/student.cpp").read_text()
BUILD = 'build = ["c++", "-O1", "-o", "student", "student.cpp"]\n'
RUN = 'run = ["./student", "-s", "{{scene}}", "-d", "0", "-o", "{{trace}}", "-e", "MISTAKE={}"]\nformat = "fosssim"\n'
SCRIPT = 'name = "mine"\nrun = ["sh", "{folder}/run.sh", "{scene}", "{trace}"]\n'
HOSTILE = f"""
cp {INSIDE}/tests/suite/expected/*/*.csv . 2>/dev/null && echo BREACH: read the oracle >&2
cat {INSIDE}/data/data.json >&2 && echo BREACH: read the data >&2
echo '{{"score": 1}}' > {INSIDE}/results/results.json && echo BREACH: wrote the results >&2
rm -rf {INSIDE}/tests && echo BREACH: removed the tests >&2
kill -9 -1
printf '<script>alert(1)</script>' >&2
exit 1
"""


def student(mistake="", source=PROGRAM):
    return {"submission.toml": 'name = "mine"\n' + BUILD + RUN.format(mistake), "student.cpp": source}


def script(text):
    return {"submission.toml": SCRIPT, "run.sh": text}


def course():
    shutil.rmtree(WORK, ignore_errors=True)
    files = ["--file", "submission.toml", "--file", "student.cpp", "--file", "*.h"]
    command = [GRADE, "export", "prairielearn", "--root", ROOT, "--assignment", "t1m3", "--image", "course/grader"]
    for _ in range(2):
        subprocess.run([*command, *files, "-o", COURSE], check=True, stderr=subprocess.DEVNULL)
    question = COURSE / "questions" / "spring-oracle-t1m3"
    info = json.loads((question / "info.json").read_text())
    uuid.UUID(info["uuid"])
    options = info["externalGradingOptions"]
    assert info["gradingMethod"] == "External" and options["image"] == "course/grader" and options["timeout"] <= 600
    assert options["entrypoint"] == ["bash", "/grade/tests/run.sh"]
    elements = {}

    class Elements(HTMLParser):
        def handle_starttag(self, tag, attrs):
            elements[tag] = dict(attrs)

    Elements().feed((question / "question.html").read_text())
    assert elements["pl-file-upload"] == {"file-names": "submission.toml,student.cpp", "optional-file-patterns": "*.h"}, elements
    assert "pl-external-grader-results" in elements
    docker = (COURSE / "image" / "Dockerfile").read_text()
    assert "COPY --chmod=755 grade " in docker and os.access(COURSE / "image" / "grade", os.X_OK)
    return question


def hand_in(question, files):
    shutil.rmtree(CONTAINER, ignore_errors=True)
    shutil.copytree(question / "tests", CONTAINER / "tests")
    (CONTAINER / "data").mkdir()
    (CONTAINER / "data" / "data.json").write_text("{}")
    (CONTAINER / "student").mkdir()
    for name, text in files.items():
        (CONTAINER / "student" / name).write_text(text)


def run(program=None):
    setting = ["--no-user-namespaces", "--no-admin", "--", "bash", INSIDE / "tests" / "run.sh"]
    environment = dict(os.environ)
    if IMAGE:
        (IMAGE / "opt/spring-oracle").mkdir(parents=True, exist_ok=True)
        shutil.copy(COURSE / "image" / "grade", IMAGE / "opt/spring-oracle/grade")
        shutil.copy(SETTING, IMAGE / "setting")
        mounts = f"mount --make-rprivate / && mount -t proc proc {IMAGE}/proc && mount --rbind /dev {IMAGE}/dev"
        inside = " ".join(map(str, ["/setting", *setting]))
        command = ["unshare", "--mount", "sh", "-c", f"{mounts} && exec chroot {IMAGE} {inside}"]
    else:
        command = [SETTING, *setting]
        environment |= {"PRAIRIELEARN_ROOT": str(CONTAINER), "SPRING_ORACLE": str(COURSE / "image" / "grade")}
    if program:
        environment["SPRING_ORACLE"] = program
    subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    text = (CONTAINER / "results" / "results.json").read_bytes()
    assert len(text) < 1_000_000, len(text)
    results = json.loads(text)
    jsonschema.validate(results, SCHEMA)
    print(f"  gradable: {results['gradable']}, score {results['score']:.3f}, {len(results['images'])} pictures, {len(text)} bytes")
    return results


def colours(url):
    """The colours of a picture."""
    png = base64.b64decode(url.split(",", 1)[1], validate=True)
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    width, height, depth, kind = struct.unpack(">IIBB", png[16:26])
    assert (depth, kind) == (8, 2)
    data, place = b"", 8
    while place < len(png):
        (length,) = struct.unpack(">I", png[place : place + 4])
        if png[place + 4 : place + 8] == b"IDAT":
            data += png[place + 8 : place + 8 + length]
        place += 12 + length
    assert len(zlib.decompress(data)) == height * (1 + 3 * width)
    return width, height


def check(question):
    hand_in(question, student())
    results = run()
    assert results["gradable"] and results["score"] == 1 and results["images"] == []
    # PrairieLearn shows both sums above all: extra credit has no maximum.
    sums = [sum(test[name] for test in results["tests"]) for name in ("points", "max_points")]
    assert sums == [29, 19] and "extra credit" in results["message"], (sums, results["message"])
    assert "protection" not in results["output"], results["output"]

    hand_in(question, student("damping: dF/dv missing"))
    results = run()
    assert results["gradable"] and 0 < results["score"] < 1
    assert len(results["images"]) >= 2 and all(colours(image["url"]) == (480, 240) for image in results["images"])
    assert any("first wrong step" in image["label"] for image in results["images"])

    hand_in(question, student(source=PROGRAM.replace("int main", "int mian(", 1)))
    results = run()
    assert not results["gradable"] and "error:" in results["output"], results
    assert "error:" not in results["format_errors"][0], results

    hand_in(question, {})
    results = run()
    assert not results["gradable"] and "submission.toml" in results["output"]

    hand_in(question, script(HOSTILE))
    results = run()
    assert results["gradable"] and results["score"] == 0 and "BREACH" not in json.dumps(results), results

    # With the usual limits, this takes minutes.
    hand_in(question, script("while :; do :; done\n"))
    with open(CONTAINER / "tests/suite/assets/rubric.toml", "a", encoding="utf-8") as rubric:
        rubric.write("\n[limits]\ncpu = 1\nwall = 2\n")
    results = run()
    assert results["gradable"] and results["score"] == 0 and "timed out" in json.dumps(results), results

    # Faults that are ours: no attempt is lost.
    hand_in(question, student())
    results = run(program="/nowhere/grade")
    assert not results["gradable"] and "not your fault" in results["format_errors"][0]
    hand_in(question, student())
    (CONTAINER / "tests/suite/assets/rubric.toml").write_text("points = ")
    results = run()
    assert not results["gradable"] and "not yours" in results["format_errors"][0]


check(course())
print("prairielearn: passed")
