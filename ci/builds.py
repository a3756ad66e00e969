#!/usr/bin/env python3
"""Twelve right programs in eight builds each, judged by the tolerances: no correct build may fail.

Ten are the self-test's program in C++ (grader/selftest/src/programs/), with orders of summation, solvers, precisions and output;
the others are that in C, which solves another system, and the fast mass-spring assignment by its hand-out. Each runs on every
scene that it supports, and `grade` judges the traces. Prints the largest share of a tolerance that a trace uses.

    ci/builds.py GRADE [BUILD…]
"""

import json
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / "target/builds"
CPP = "grader/selftest/src/programs/student.cpp"
BACKWARDS = {"ORDER": "reversed"}
KRYLOV = {"SOLVER": "krylov", "TOLERANCE": "1e-15"}
LONG = ["-DREAL=long double"]

# name: source, macros, settings in the environment
PROGRAMS = {
    "LU with pivots": (CPP, [], {}),
    "forces summed backwards": (CPP, [], BACKWARDS),
    "LU without pivots": (CPP, [], {"SOLVER": "nopivot"}),
    "conjugate gradients to 1e-15": (CPP, [], KRYLOV),
    "long double": (CPP, LONG, {}),
    "CSV by %.17g": (CPP, [], {"FORMAT": "csv"}),
    "CSV by %.16e": (CPP, [], {"FORMAT": "csv", "DIGITS": "%.16e"}),
    "backwards, without pivots": (CPP, [], {**BACKWARDS, "SOLVER": "nopivot"}),
    "backwards, conjugate gradients": (CPP, [], {**BACKWARDS, **KRYLOV}),
    "backwards, long double": (CPP, LONG, BACKWARDS),
    "4 n unknowns, in C": ("grader/selftest/src/programs/student.c", [], {}),
    "fast mass-spring": ("grader/grade/tests/it/programs/fast_mass_springs.cpp", [], {}),
}

# name: prefix of the compilers, flags, what runs the program
BUILDS = {
    "FMA": ("", ["-O2", "-mfma", "-ffp-contract=fast"], []),
    "no vectors": ("", ["-O2", "-fno-tree-vectorize"], []),
    "-O0": ("", ["-O0"], []),
    "-Ofast": ("", ["-Ofast", "-march=native"], []),
    "aarch64": ("aarch64-linux-gnu-", ["-O2", "-static"], ["qemu-aarch64"]),
    "x87": ("i686-linux-gnu-", ["-O2", "-mfpmath=387", "-static"], []),
    "musl": ("zig", ["-O2", "-target", "x86_64-linux-musl"], []),
    "Windows": ("x86_64-w64-mingw32-", ["-O2", "-static"], ["wine"]),
}


def compiler(prefix, source):
    is_c = source.endswith(".c")
    if prefix == "zig":
        return [sys.executable, "-m", "ziglang", "cc" if is_c else "c++"]
    return [prefix + ("gcc" if is_c else "g++")]


def scenes(source):
    """Scenes that may be in a program's scope, by name: in the plane, or of the fast mass-spring assignment."""
    found = {}
    for folder in (ROOT / "assets", ROOT / "extracreditassets"):
        pattern = "FastMassSpring/**/*.json" if "fast_mass" in source else "[A-Z]*/**/*.xml"
        for path in sorted(folder.glob(pattern)):
            if " pz=" not in path.read_text():
                found[str(path.relative_to(folder).with_suffix(""))] = path
    return found


def run(command, call, environment, scene, trace):
    """Runs a program on a scene; leaves no trace of one that it does not support."""
    trace.parent.mkdir(parents=True, exist_ok=True)
    # Relative paths are the same ones for Wine; a mesh is named relative to its scene.
    path = os.path.relpath(trace, scene.parent)
    done = subprocess.run([*command, *call(scene.name, path)], cwd=scene.parent, env=environment, stdin=subprocess.DEVNULL,
                          capture_output=True, timeout=300)
    if done.returncode != 0:
        trace.unlink(missing_ok=True)


def judge(grade, traces):
    """The largest share of a tolerance that a trace uses, the number of traces, and messages of those that fail."""
    report = traces.with_suffix(".json")
    subprocess.run([grade, traces, "--no-progress", "--no-jacobians", "--report", f"json={report}"],
                   cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True)
    given = {str(path.relative_to(traces).with_suffix("")) for path in traces.rglob("*.*")}
    if not given:
        return 0, 0, ["no trace at all"]
    scenes = [scene for feature in json.loads(report.read_text())["features"] for scene in feature["scenes"]]
    judged = [scene for scene in scenes if scene["name"] in given]
    used = max((scene["calibration"]["used"] for scene in judged if scene["calibration"]), default=0)
    return used, len(judged), [f"{scene['name']}: {scene['message']}" for scene in judged if scene["verdict"] != "pass"]


def tried(grade, build, name, folder):
    """Builds a program, runs it on its scenes, and judges its traces."""
    (prefix, flags, runner), (source, macros, settings) = BUILDS[build], PROGRAMS[name]
    traces = folder / "traces"
    traces.mkdir(parents=True)
    program = folder / ("student.exe" if build == "Windows" else "student")
    subprocess.run([*compiler(prefix, source), *flags, *macros, "-w", "-o", program, ROOT / source, "-lm"], check=True)
    environment = {**os.environ, **settings, "WINEDEBUG": "-all"}
    if "fast_mass" in source:
        form, call = "csv", lambda scene, trace: [scene, trace]
    else:
        form, call = settings.get("FORMAT", "bin"), lambda scene, trace: ["-s", scene, "-d", "0", "-o", trace]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        runs = [pool.submit(run, [*runner, program], call, environment, path, traces / f"{scene}.{form}")
                for scene, path in scenes(source).items()]
    for each in runs:
        each.result()
    return judge(grade, traces)


def main():
    grade, builds = Path(sys.argv[1]).resolve(), sys.argv[2:] or list(BUILDS)
    shutil.rmtree(WORK, ignore_errors=True)
    n_failed = 0
    print(f"| program | scenes | {' | '.join(builds)} |")
    print(f"| --- | ---: |{' ---: |' * len(builds)}")
    for number, name in enumerate(PROGRAMS):
        results = {build: tried(grade, build, name, WORK / build / str(number)) for build in builds}
        counts = {n_scenes for _, n_scenes, _ in results.values()}
        shares = " | ".join(f"{100 * used:.1f} %" for used, _, _ in results.values())
        print(f"| {name} | {'/'.join(map(str, counts))} | {shares} |", flush=True)
        # Each build supports the same scenes.
        n_failed += len(counts) - 1 + (0 in counts)
        for build, (_, _, failed) in results.items():
            n_failed += len(failed)
            for message in failed:
                print(f"{name}, {build}: {message}", file=sys.stderr)
    sys.exit(f"builds: {n_failed} failed" if n_failed else 0)


main()
