#!/usr/bin/env python3
"""Findings on changes of source that no list of the grader has: one node of the syntax tree of a right program is changed.

    ci/mutants.py GRADE [COUNT] [SEED]

The programs are those of the self-test in C++, C and Python (grader/selftest/src/programs). An operator, a sign, a number, a
name, the order of arguments or statements, a guard, or a whole statement is changed, one in each program, drawn by the seed:
first the language and the kind of change, then the place. The place says which features a true finding may name. Programs that do
not compile, or whose traces all pass, are left out. Prints each program whose findings are false or missing, then the rates.
Needs tree-sitter with its grammars of the three languages; ci/mutants.sh installs them.
"""

import json
import random
import re
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import tree_sitter_c
import tree_sitter_cpp
import tree_sitter_python
from tree_sitter import Language, Parser

PROGRAMS = Path(__file__).resolve().parent.parent / "grader/selftest/src/programs"

IMPLICIT = "integrator (linearized-)?implicit-euler"
EXPLICIT = "integrator (explicit|symplectic)-euler"
PAIRS = "springforce|gravitationalforce|vortexforce|functions on vectors"
BODIES = "simplegravity|constantforce|dragdamping"
FIXED = "fixed particles"
SYSTEM = f"{IMPLICIT}|Jacobians|{FIXED}"
# The functions that every force between two particles calls.
BLOCKS = f"{SYSTEM}|functions on vectors"

# Of each program: its grammar, how it is built, what it lacks, and which features a change changes: from the first line with
# the words on, to the next entry. `None`: changes there may show as anything, or nowhere.
LANGUAGES = {
    "C++": (
        "student.cpp",
        tree_sitter_cpp,
        ["g++", "-O1", "-w", "-o", "program", "student.cpp"],
        "nothing",
        [
            ("static void law(", PAIRS),
            ("Real k = e.p[0], l0", "springforce"),
            ("} else if (e.kind == GRAVITATION) {", PAIRS),
            ("Real s = e.p[0] * mass", "gravitationalforce"),
            ("// The hand-out's direction goes", "vortexforce"),
            ("static void add(", BLOCKS),
            ("static void evaluate(", f"{PAIRS}|reading|integrator"),
            ("for (int p = 0; p < n; p++) {", f"{BODIES}|masses"),
            ("static void lu(", SYSTEM),
            ("static Vec times(", None),
            ("static void explicit_step()", f"{EXPLICIT}|{FIXED}"),
            ("// One system of Newton's method", SYSTEM),
            ("// Whether Newton's method may stop", IMPLICIT),
            ("static void step()", f"integrator|{FIXED}"),
            ("static Real number(", None),
        ],
    ),
    "C": (
        "student.c",
        tree_sitter_c,
        ["gcc", "-O1", "-w", "-o", "program", "student.c", "-lm"],
        "constantforce|vortexforce|integrator (explicit|implicit)-euler",
        [
            ("static void couple(", BLOCKS),
            ("static void forces(", f"{PAIRS}|{BODIES}|reading|integrator"),
            ("double k = link[e].a", "springforce"),
            ("    } else {", "gravitationalforce"),
            ("F[2 * i] += fx", PAIRS),
            ("for (p = 0; p < s; p++) {", f"{BODIES}|masses"),
            ("static void solve(", SYSTEM),
            ("static void step(", f"integrator|{FIXED}"),
            ("K = malloc", SYSTEM),
            ("int main(", None),
        ],
    ),
    "Python": (
        "student.py",
        tree_sitter_python,
        None,
        "constantforce|integrator implicit-euler",
        [
            ("def spring(", "springforce"),
            ("def gravitation(", "gravitationalforce"),
            ("def vortex(", "vortexforce"),
            ("class Scene", None),
            ("def forces(", f"{PAIRS}|{BODIES}|reading"),
            ("def parts(", None),
            ("def step(", f"integrator|{FIXED}"),
            ("ahead = [", SYSTEM),
            ("def main(", None),
        ],
    ),
}

OPERATORS = {
    "+": ["-"],
    "-": ["+"],
    "*": ["/"],
    "/": ["*"],
    "**": ["*"],
    "+=": ["=", "-="],
    "-=": ["=", "+="],
    "<": ["<="],
    ">": [">="],
    "==": ["!="],
    "!=": ["=="],
    "&&": ["||"],
    "||": ["&&"],
    "and": ["or"],
    "or": ["and"],
}
STATEMENTS = {"expression_statement", "declaration", "continue_statement"}
# Findings that blame nothing, and those on how a program ends.
BLAMELESS = {"common", "crash", "time-out", "memory", "output"}


def text(node):
    return node.text.decode()


def changes(node, random):
    """Changes of a node: kind, start, end and the new text."""

    def put(kind, at, new):
        return kind, at.start_byte, at.end_byte, new

    operator = node.child_by_field_name("operator")
    if operator is not None and node.child_count > 2:
        in_loop = node.parent.type == "for_statement" and node.type == "binary_expression"
        yield from () if in_loop else (put("operator", operator, new) for new in OPERATORS.get(text(operator), []))
    if node.type in ("unary_expression", "unary_operator") and text(node).startswith("-"):
        yield put("sign", node, text(node)[1:])
    if node.type in ("number_literal", "integer", "float") and re.fullmatch(r"\d+", text(node)):
        if "declarator" not in node.parent.type:
            number = int(text(node))
            yield from (put("number", node, str(new)) for new in {number + 1, max(number - 1, 0)} - {number})
    if node.type == "identifier":
        function = node
        while function.parent is not None and "function_definition" not in function.type:
            function = function.parent
        names = sorted(set(re.findall(r"\b[A-Za-z_]\w*\b", text(function))))
        declared = "declarator" in node.parent.type or node.parent.type in ("call_expression", "call", "keyword_argument")
        # Names of one or two letters stand for each other most likely.
        alike = [name for name in names if len(name) <= max(2, len(text(node))) and name != text(node)]
        if alike and not declared:
            yield put("name", node, random.choice(alike))
    if node.type == "argument_list":
        arguments = node.named_children
        for first, second in zip(arguments, arguments[1:]):
            whole = text(node.parent)[first.start_byte - node.parent.start_byte : second.end_byte - node.parent.start_byte]
            between = whole[len(text(first)) : len(whole) - len(text(second))]
            yield "arguments", first.start_byte, second.end_byte, text(second) + between + text(first)
    condition = node.child_by_field_name("condition")
    if node.type == "if_statement" and condition is not None:
        python = not text(condition).startswith("(")
        true, false = ("True", "False") if python else ("(1)", "(0)")
        yield from (put("guard", condition, new) for new in (true, false))
    if node.type in STATEMENTS:
        empty = "pass" if node.type == "expression_statement" and not text(node).endswith(";") else ";"
        if node.type != "declaration":
            yield put("statement left out", node, empty)
        following = node.next_named_sibling
        if following is not None and following.type in STATEMENTS:
            between = node.parent.text[node.end_byte - node.parent.start_byte : following.start_byte - node.parent.start_byte]
            both = text(following) + between.decode() + text(node)
            yield "order of statements", node.start_byte, following.end_byte, both


def mutants(language, random):
    """Every change of a program, by kind: start, end, new text and the pattern of the features that it changes."""
    file, grammar, _, _, regions = LANGUAGES[language]
    source = (PROGRAMS / file).read_bytes()
    lines = source.decode().splitlines()
    patterns, pattern, left = [], None, list(regions)
    for line in lines:
        if left and left[0][0] in line:
            pattern = left.pop(0)[1]
        # Planted mistakes are not run.
        planted = re.search(r"\bis\(\"|MISTAKE|setting\(|SOLVER|getenv", line)
        patterns.append(None if planted else pattern)
    assert not left, f"{file}: {left[0][0]}"
    found = {}

    def walk(node):
        rows = range(node.start_point.row, node.end_point.row + 1)
        for kind, start, end, new in changes(node, random):
            pattern = patterns[node.start_point.row]
            if pattern and all(patterns[row] for row in rows if kind != "guard"):
                found.setdefault(kind, []).append((start, end, new, pattern))
        for child in node.named_children:
            walk(child)

    walk(Parser(Language(grammar.language())).parse(source).root_node)
    return source, found


def grade(grade, folder, mutant):
    language, kind, source, (start, end, new, pattern) = mutant
    file, _, build, lacks, _ = LANGUAGES[language]
    changed = source[:start] + new.encode() + source[end:]
    line = source[:start].count(b"\n")
    old, after = (text.decode().splitlines()[line].strip() for text in (source, changed))
    words = f"{language}, {kind}, line {line + 1}: `{old}` -> `{after}`"
    place = Path(tempfile.mkdtemp(dir=folder))
    (place / file).write_bytes(changed)
    run = '["/usr/bin/python3", "-S", "-E", "{folder}/student.py", "{scene}", "-o", "{trace}"]'
    if build:
        if subprocess.run(build, cwd=place, capture_output=True).returncode:
            return ("does not compile", language, kind, words, [])
        run = '["./program", "-s", "{scene}", "-d", "0", "-o", "{trace}"]'
    form = "csv" if language == "Python" else "fosssim"
    (place / "submission.toml").write_text(f'name = "mutant"\nrun = {run}\nformat = "{form}"\n')
    report = place / "report.json"
    # A change may make a loop endless.
    command = [grade, place, "--assignment", "t1m3", "--no-jacobians", "--limit", "cpu=5", "--report", f"json={report}"]
    subprocess.run(command, capture_output=True, timeout=1200)
    findings = json.loads(report.read_text())["findings"]
    about = lambda one, pattern: any(re.search(pattern, way["feature"]) for way in one["alternatives"])
    findings = [one for one in findings if not (about(one, lacks) and one["kind"] in ("no-effect", "not-implemented", "common"))]
    if not findings:
        return ("passes", language, kind, words, [])
    lists = [f"{one['kind']}: {one['message']}" for one in findings]
    blaming = [one for one in findings if one["kind"] not in BLAMELESS]
    false = [one for one in blaming if not about(one, pattern)]
    proven = [one for one in blaming if one["kind"] in ("cause", "no-effect", "not-implemented")]
    if any(one in proven for one in false):
        return ("FALSE CAUSE", language, kind, words, lists)
    if false:
        return ("misdirected", language, kind, words, lists)
    return ("named" if proven else "pointed at" if blaming else "without a cause", language, kind, words, lists)


def main():
    program = Path(sys.argv[1]).resolve()
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 120
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    draw = random.Random(seed)
    all_mutants = {language: mutants(language, draw) for language in LANGUAGES}
    drawn = []
    for _ in range(count):
        language = draw.choice(list(all_mutants))
        source, by_kind = all_mutants[language]
        kind = draw.choice(sorted(by_kind))
        drawn.append((language, kind, source, draw.choice(by_kind[kind])))
    tally, by_language = Counter(), Counter()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        for outcome, language, kind, words, findings in pool.map(lambda one: grade(program, folder, one), drawn):
            tally[outcome] += 1
            if outcome in ("does not compile", "passes"):
                continue
            by_language[language, outcome] += 1
            if outcome != "named":
                print(f"{outcome}: {words}", *(f"    {one}" for one in findings), sep="\n", flush=True)
    wrong = max(sum(by_language.values()), 1)
    n_all = sum(len(places) for _, by_kind in all_mutants.values() for places in by_kind.values())
    print(f"{n_all} changes, {count} drawn by {seed}, {wrong} wrong programs")
    for outcome, n in tally.most_common():
        counts = [f"{by_language[language, outcome]} in {language}" for language in LANGUAGES]
        is_wrong = outcome not in ("does not compile", "passes")
        print(f"    {outcome:18} {n:4}", f"{n / wrong:6.1%}   {', '.join(counts)}" if is_wrong else "")
    false = tally["FALSE CAUSE"] + tally["misdirected"]
    # Of few programs, one may be wrong.
    sys.exit(false > max(1, wrong // 100))


main()
