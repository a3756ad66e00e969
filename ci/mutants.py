#!/usr/bin/env python3
"""Findings on changes of source that no list of the grader has: one token of a right program in C++ is changed.

    ci/mutants.py GRADE [COUNT] [SEED]

Operators, signs, indices, numbers, variables and guards of grader/selftest/src/programs/student.cpp are changed, one in each
program, drawn by the seed. The place of the change says which features a true finding may name. Programs that do not
compile, or whose traces all pass, are left out. Prints each program whose findings are false or missing, then the rates.
"""

import json
import random
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "grader/selftest/src/programs/student.cpp"

# What a change of these lines changes: from the first line with the words, to the next entry. Of a finding, one
# alternative must match.
IMPLICIT = "integrator (linearized-)?implicit-euler"
PAIRS = "springforce|gravitationalforce|vortexforce"
FIXED = "fixed particles"
REGIONS = [
    ("static void law(", PAIRS),
    ("if (e.kind == SPRING) {", "springforce"),
    ("} else if (e.kind == GRAVITATION) {", "gravitationalforce"),
    ("// The hand-out's direction goes", "vortexforce"),
    ("static void add(", "Jacobians|" + IMPLICIT),
    ("static void evaluate(", f"{PAIRS}|reading"),
    ("for (int p = 0; p < n; p++) {", "simplegravity|constantforce|dragdamping|masses"),
    ("static void lu(", f"{IMPLICIT}|Jacobians"),
    ("static Vec times(", None),
    ("static void explicit_step()", f"integrator (explicit|symplectic)-euler|{FIXED}"),
    ("// One system of Newton's method", f"{IMPLICIT}|Jacobians|{FIXED}"),
    ("// Whether Newton's method may stop", IMPLICIT),
    ("static void step()", f"integrator|{FIXED}"),
    ("static Real number(", None),
    ("static void element(", "."),
    ("static void parse(", None),
]

# Words of findings that say where, or that nothing is known: they blame nothing.
BLAMELESS = {"common"}


def changes(token, before, after):
    """The changes of a token, between the texts before and after it on its line."""
    operators = {"+": "-", "-": "+", "*": "/", "/": "*", "+=": "=", "-=": "+=", "<": "<=", "==": "!=", "&&": "||"}
    if token in operators and not re.search(r"[,(=*/<&|+-]\s*$|return\s*$", before):
        # A comparison of a loop's counter would read outside of its list.
        return [] if token == "<" and "for (" in before else [operators[token]]
    if token == "-":
        return [""]
    if re.fullmatch(r"\d+", token) and not before.endswith(("Real ", "[")):
        return [str(int(token) + 1), str(max(int(token) - 1, 0))]
    if token in ("0", "1") and before.endswith("["):
        return ["1" if token == "0" else "0"]
    names = [("i", "j"), ("d", "w"), ("K", "B"), ("u", "v"), ("x", "ahead"), ("k", "b"), ("k", "l0"), ("nn", "w"), ("A", "D"), ("old", "v"), ("r", "c")]
    swaps = [b for a, b in [*names, *((b, a) for a, b in names)] if token == a]
    return swaps


def mutants():
    """Every change: line, column, token, replacement, and the pattern of the features that it changes."""
    lines = SOURCE.read_text().splitlines()
    found, pattern, regions = [], None, list(REGIONS)
    for number, line in enumerate(lines):
        if regions and regions[0][0] in line:
            pattern = regions.pop(0)[1]
        # Planted mistakes are not run.
        if pattern is None or 'is("' in line or "setting(" in line or line.strip().startswith(("//", "static", "#")):
            continue
        code = line.split("//")[0]
        for match in re.finditer(r"[A-Za-z_]\w*|\d+(?:\.\d+)?(?:e-?\d+)?|\+=|-=|\+\+|--|==|<=|>=|&&|\|\||[-+*/<>]", code):
            token, before, after = match.group(), code[: match.start()], code[match.end() :]
            if before.count('"') % 2:
                continue
            for new in (new for new in changes(token, before, after) if new != token):
                found.append((number, match.start(), token, new, pattern))
    return lines, found


def grade(grade, folder, lines, mutant):
    number, column, token, new, pattern = mutant
    changed = list(lines)
    changed[number] = lines[number][:column] + new + lines[number][column + len(token) :]
    words = f"line {number + 1}: `{lines[number].strip()}` -> `{changed[number].strip()}`"
    place = Path(tempfile.mkdtemp(dir=folder))
    (place / "main.cpp").write_text("\n".join(changed) + "\n")
    if subprocess.run(["g++", "-O1", "-w", "-o", place / "program", place / "main.cpp"], capture_output=True).returncode:
        return ("does not compile", words, [])
    report = place / "report.json"
    command = [grade, place / "program", "--assignment", "t1m3", "--no-jacobians", "--report", f"json={report}"]
    subprocess.run(command, capture_output=True, timeout=600)
    findings = json.loads(report.read_text())["findings"]
    if not findings:
        return ("passes", words, [])
    lists = [f"{one['kind']}: {one['message']}" for one in findings]
    is_true = lambda one: any(re.search(pattern, way["feature"]) for way in one["alternatives"])
    blaming = [one for one in findings if one["kind"] not in BLAMELESS]
    ends = {"crash", "time-out", "memory", "output", "not-implemented"}
    false = [one for one in blaming if not is_true(one) and one["kind"] not in ends]
    proven = [one for one in blaming if one["kind"] == "cause" and is_true(one)]
    if any(one["kind"] == "cause" for one in false):
        return ("FALSE CAUSE", words, lists)
    if false:
        return ("misdirected", words, lists)
    return ("named" if proven else "pointed at" if blaming else "without a cause", words, lists)


def main():
    program = Path(sys.argv[1]).resolve()
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    lines, all_mutants = mutants()
    drawn = random.Random(seed).sample(all_mutants, min(count, len(all_mutants)))
    tally = {}
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        for kind, words, findings in pool.map(lambda one: grade(program, folder, lines, one), drawn):
            tally[kind] = tally.get(kind, 0) + 1
            if kind not in ("does not compile", "passes", "named"):
                print(f"{kind}: {words}", *(f"    {one}" for one in findings), sep="\n", flush=True)
    wrong = sum(n for kind, n in tally.items() if kind not in ("does not compile", "passes"))
    print(f"{len(all_mutants)} changes, {len(drawn)} drawn by {seed}, {wrong} wrong programs")
    for kind, n in sorted(tally.items(), key=lambda item: -item[1]):
        print(f"    {kind:18} {n}")


main()
