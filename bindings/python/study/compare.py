"""Which mistakes do checks of Jacobians catch, and which right functions do they accuse?

    python compare.py --markdown ../../../docs/functions.md     # rewrites the table between its marks; some ten minutes

Each check gets what its user would give it. Ours: the box of the arguments. The others: three points drawn from it, at their
defaults, and at the step that serves them best over all cases. scipy's check_grad and JAX's check_grads are run as they are, if
they are installed. torch's gradcheck is run by its published method (central differences, |a − n| ≤ atol + rtol |n|), since its
package brings several gigabytes.
"""

import argparse
import collections
import re
import sys
from pathlib import Path

import corpus
import numpy as np
import spring_oracle

POINTS = 3
STEPS = [10.0**-k for k in range(2, 11)]

# The word by which a report names each planted kind.
NAMES = {
    "negative": "exactly the negative", "transposed": "transposed", "factor ½": "factor ½", "factor 2": "factor 2",
    "factor h": "factor h too", "factor h²": "factor h²", "factor m": "factor m too", "zero": "missing", "symmetrised": "symmetric",
    "columns exchanged": "columns of", "rows exchanged": "rows of", "one entry": "entry (", "block missing": "missing",
    "block negated": "negative", "block transposed": "transposed", "row missing": "missing", "column missing": "missing",
    "only the diagonal": "all but the diagonal", "only one triangle": "upper triangle", "one direction": "one direction",
    "another point": "another state", "a millionth": "relative 1.0e-6",
}  # fmt: skip


def ours(function):
    return spring_oracle.check_jacobian(
        function.f, function.jac, domain=(function.lower, function.upper), block=function.block,
        factors={"h": corpus.H, "m": corpus.MASS}, search=function.n < 100,
    )  # fmt: skip


def is_named(report, kind):
    branch = kind.startswith("one branch, ")
    name = NAMES[kind.removeprefix("one branch, ")]
    return name in report.likeness and (report.on_branch or not branch)


def points(function):
    rng = np.random.default_rng(11)
    return [rng.uniform(function.lower, function.upper) for _ in range(POINTS)]


def differences(function, x, step, central):
    columns = []
    here = function.f(x)
    for column in range(x.size):
        moved = x.copy()
        moved[column] += step
        above = function.f(moved)
        moved[column] = x[column] - step
        columns.append((above - function.f(moved)) / (2 * step) if central else (above - here) / step)
    return np.array(columns).T


def gradcheck(function, step):
    """Whether torch.autograd.gradcheck would pass: eps 1e-6, atol 1e-5, rtol 1e-3."""
    return all(
        np.allclose(function.jac(x), differences(function, x, step, True), rtol=1e-3, atol=1e-5) for x in points(function)
    )


def check_grad(function, step):
    """scipy.optimize.check_grad, with the threshold that its users choose: 1e-6 of the Jacobian's norm."""
    from scipy.optimize import check_grad

    return all(check_grad(function.f, function.jac, x, epsilon=step) <= 1e-6 * np.linalg.norm(function.jac(x)) for x in points(function))


def check_grads(function, step):
    import jax
    from jax.test_util import check_grads

    jax.config.update("jax_enable_x64", True)
    m = np.size(function.f(points(function)[0]))
    shape = jax.ShapeDtypeStruct((m,), np.float64)
    matrix = jax.ShapeDtypeStruct((m, function.n), np.float64)

    @jax.custom_jvp
    def f(x):
        return jax.pure_callback(lambda x: np.asarray(function.f(np.asarray(x)), dtype=float), shape, x)

    @f.defjvp
    def _(primals, tangents):
        jacobian = jax.pure_callback(lambda x: np.asarray(function.jac(np.asarray(x)), dtype=float), matrix, primals[0])
        return f(primals[0]), jacobian @ tangents[0]

    try:
        for x in points(function):
            check_grads(f, (x,), order=1, modes=["fwd"], eps=step)
    except AssertionError:
        return False
    return True


def available():
    others = [("torch.autograd.gradcheck", gradcheck, 1e-6)]
    for name, module, check, step in (
        ("scipy.optimize.check_grad", "scipy.optimize", check_grad, 1.4901161193847656e-08),
        ("jax.test_util.check_grads", "jax", check_grads, None),
    ):
        try:
            __import__(module)
            others.append((name, check, step))
        except ImportError:
            print(f"{name} is not installed: left out", file=sys.stderr)
    return others


def score(check, step, mistakes, rights):
    caught = sum(not check(mistake.function, step) for mistake in mistakes)
    accused = sum(not check(function, step) for function in rights)
    return caught, accused


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--markdown", type=Path, help="page in which the table stands")
    parser.add_argument("--every", type=int, default=1, help="take every so many-th case only")
    parser.add_argument("--ours", action="store_true", help="leave the other checks out")
    arguments = parser.parse_args()
    np.seterr(all="ignore")
    mistakes, rights = corpus.mistakes()[:: arguments.every], corpus.rights()[:: arguments.every]
    rows, verdicts, kinds = [], collections.Counter(), collections.Counter()
    named = 0
    for mistake in mistakes:
        report = ours(mistake.function)
        verdicts["mistake", report.verdict] += 1
        if report.verdict == "wrong" and is_named(report, mistake.kind):
            named += 1
        else:
            kinds[mistake.kind] += 1
            print(f"{mistake.name}: {report.verdict}, {report.likeness}", file=sys.stderr)
    for function in rights:
        report = ours(function)
        verdicts["right", report.verdict] += 1
        if not report:
            print(f"{function.name} ({function.hard}): {report}", file=sys.stderr)
    caught, accused = verdicts["mistake", "wrong"], verdicts["right", "wrong"]
    unsure = [verdicts[kind, "inconclusive"] for kind in ("mistake", "right")]
    missed = len(mistakes) - caught - unsure[0]
    rows.append(f"| Spring Oracle | none to choose | {caught} | {missed} | {unsure[0]} | {accused} | {unsure[1]} | {named} |")
    print(rows[-1], flush=True)
    for name, check, default in [] if arguments.ours else available():
        scores = {step: score(check, step, mistakes, rights) for step in [default, *STEPS]}
        best = max(STEPS, key=lambda step: scores[step][0] - scores[step][1])
        for title, step in (("default", default), (f"best: {best:.0e}", best)):
            caught, accused = scores[step]
            rows.append(f"| `{name}` | {title} | {caught} | {len(mistakes) - caught} | – | {accused} | – | – |")
            print(rows[-1], flush=True)
    if arguments.markdown:
        text = arguments.markdown.read_text()
        header = "| check | step | caught | missed | inconclusive | accused | inconclusive | named |\n| --- | --- | " + "---: | " * 6
        table = "\n".join([header.rstrip(), *rows])
        text = re.sub(r"(<!-- study -->\n).*?(\n<!-- end -->)", lambda m: m[1] + table + m[2], text, flags=re.S)
        arguments.markdown.write_text(text)


if __name__ == "__main__":
    main()
