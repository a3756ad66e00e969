"""Which mistakes do checks of Jacobians catch, and which right functions do they accuse?

    python compare.py --markdown ../../../docs/functions.md     # rewrites the table between its marks; some ten minutes

Each check gets what its user would give it. Ours: the box of the arguments. The others: three points drawn from it, at their
defaults, and at the step that serves them best over all cases. Each is run as it is published, if it is installed: torch, scipy, JAX, and
two libraries of C++, once these are built in this folder, finite-diff with its sources in FD:

    g++ -O2 -shared -fPIC -I/usr/include/eigen3 ceres.cpp -o libceres_check.so -lceres -lglog
    g++ -O2 -shared -fPIC -I/usr/include/eigen3 -IFD finite_diff.cpp FD/finitediff.cpp -o libfinite_diff_check.so -lspdlog -lfmt

Rows of the table that were not measured again are kept: `--peers NAME` runs one peer, in an environment that has it.
"""

import argparse
import collections
import ctypes
import functools
import re
import sys
from pathlib import Path

import corpus
import numpy as np

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
    import spring_oracle

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


def gradcheck(function, step):
    """Whether torch.autograd.gradcheck passes: atol 1e-5, rtol 1e-3, central differences."""
    import torch

    class Custom(torch.autograd.Function):
        @staticmethod
        def forward(ctx, x):
            ctx.save_for_backward(x)
            return torch.tensor(np.asarray(function.f(np.array(x.tolist())), dtype=float).tolist(), dtype=torch.float64)

        @staticmethod
        def backward(ctx, grad):
            jacobian = np.asarray(function.jac(np.array(ctx.saved_tensors[0].tolist())), dtype=float)
            return torch.tensor((np.array(grad.tolist()) @ jacobian).tolist(), dtype=torch.float64)

    def passes(x):
        x = torch.tensor(x.tolist(), dtype=torch.float64, requires_grad=True)
        return torch.autograd.gradcheck(Custom.apply, (x,), eps=step, raise_exception=False)

    return all(passes(x) for x in points(function))


def in_cpp(name, function):
    """The library built of NAME.cpp, and the function as its callback."""
    library = ctypes.CDLL(str(built(name)))
    m = np.size(function.f(points(function)[0]))

    def evaluate(x, values, jacobian):
        x = np.ctypeslib.as_array(x, (function.n,)).copy()
        np.ctypeslib.as_array(values, (m,))[:] = function.f(x)
        if jacobian:
            np.ctypeslib.as_array(jacobian, (m, function.n))[:] = function.jac(x)

    return library, (ctypes.CFUNCTYPE(None, *[ctypes.POINTER(ctypes.c_double)] * 3)(evaluate), function.n, m)


def address(x):
    return np.ascontiguousarray(x).ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def gradient_checker(function, step):
    """Whether ceres::GradientChecker passes: Ridders' method, relative precision 1e-8 as in the solver's option of the same name."""
    library, given = in_cpp("ceres", function)
    return all(library.gradient_check(*given, address(x), *map(ctypes.c_double, (step, 1e-8))) for x in points(function))


def compare_jacobian(function, step):
    """Whether fd::compare_jacobian passes: 1e-4 of the larger of 1 and the entries."""
    library, given = in_cpp("finite_diff", function)
    return all(library.compare_jacobian(*given, address(x), ctypes.c_double(step)) for x in points(function))


def check_grad(function, step):
    """scipy.optimize.check_grad, with the threshold that its users choose: 1e-6 of the Jacobian's norm."""
    from scipy.optimize import check_grad

    return all(check_grad(function.f, function.jac, x, epsilon=step) <= 1e-6 * np.linalg.norm(function.jac(x)) for x in points(function))


@functools.cache
def traced(n, m):
    """A function of n numbers with m values and its derivative by hand, compiled once for all of this shape, and where it looks up
    the one that it stands for."""
    import jax

    current = []
    values = jax.ShapeDtypeStruct((m,), np.float64)
    matrix = jax.ShapeDtypeStruct((m, n), np.float64)

    @jax.custom_jvp
    def f(x):
        return jax.pure_callback(lambda x: np.asarray(current[0].f(np.array(x)), dtype=float), values, x)

    @f.defjvp
    def _(primals, tangents):
        jacobian = jax.pure_callback(lambda x: np.asarray(current[0].jac(np.array(x)), dtype=float), matrix, primals[0])
        return f(primals[0]), jacobian @ tangents[0]

    return jax.jit(f), current


def check_grads(function, step):
    """Whether jax.test_util.check_grads passes, forwards and backwards as by default."""
    import jax
    from jax.test_util import check_grads

    jax.config.update("jax_enable_x64", True)
    f, current = traced(function.n, np.size(function.f(points(function)[0])))
    current[:] = [function]
    try:
        for x in points(function):
            check_grads(f, (x,), order=1, eps=step)
    except AssertionError:
        return False
    return True


def built(name):
    library = Path(__file__).with_name(f"lib{name}_check.so")
    if not library.exists():
        raise ImportError
    return library


PEERS = [
    ("torch.autograd.gradcheck", lambda: __import__("torch"), gradcheck, 1e-6),
    ("scipy.optimize.check_grad", lambda: __import__("scipy.optimize"), check_grad, 1.4901161193847656e-08),
    ("jax.test_util.check_grads", lambda: __import__("jax"), check_grads, None),
    ("ceres::GradientChecker", lambda: built("ceres"), gradient_checker, 1e-2),
    ("fd::compare_jacobian", lambda: built("finite_diff"), compare_jacobian, 1e-8),
]


def available(peers):
    for name, load, check, default in PEERS:
        if not peers or any(peer in name for peer in peers):
            try:
                load()
                yield name, check, default
            except ImportError:
                print(f"{name} is not installed: left out", file=sys.stderr)


def score(check, step, mistakes, rights):
    caught = sum(not check(mistake.function, step) for mistake in mistakes)
    accused = sum(not check(function, step) for function in rights)
    return caught, accused


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--markdown", type=Path, help="page in which the table stands")
    parser.add_argument("--every", type=int, default=1, help="take every so many-th case only")
    parser.add_argument("--ours", action="store_true", help="leave the other checks out")
    parser.add_argument("--steps", type=float, nargs="+", default=STEPS, help="steps of the peers, besides their own")
    parser.add_argument("--peers", action="append", default=[], metavar="NAME", help="run only the peers whose names have this part")
    arguments = parser.parse_args()
    np.seterr(all="ignore")
    mistakes, rights = corpus.mistakes()[:: arguments.every], corpus.rights()[:: arguments.every]
    rows = {} if arguments.peers else {"Spring Oracle": measured(mistakes, rights)}
    print(*rows.values(), flush=True)
    for name, check, default in [] if arguments.ours else available(arguments.peers):
        scores = {step: score(check, step, mistakes, rights) for step in [default, *arguments.steps]}
        best = max(arguments.steps, key=lambda step: scores[step][0] - scores[step][1])
        for title, step in (("default", default), (f"best: {best:.0e}", best)):
            caught, accused = scores[step]
            row = f"| `{name}` | {title} | {caught} | {len(mistakes) - caught} | – | {accused} | – | – |"
            rows[f"{name} {title[:4]}"] = row
            print(row, flush=True)
    if arguments.markdown:
        text = arguments.markdown.read_text()
        before, table, after = re.fullmatch(r"(.*<!-- study -->\n)(.*)(\n<!-- end -->.*)", text, flags=re.S).groups()
        known = {}
        for row in table.splitlines()[2:]:
            name, step = (cell.strip(" `") for cell in row.split("|")[1:3])
            known[name if name == "Spring Oracle" else f"{name} {step[:4]}"] = row
        header = "| check | step | caught | missed | inconclusive | accused | inconclusive | named |\n| --- | --- |" + " ---: |" * 6
        arguments.markdown.write_text(before + "\n".join([header, *{**known, **rows}.values()]) + after)


def measured(mistakes, rights):
    """The row of our own check; on standard error, what is not caught, not named or not correct."""
    verdicts, named = collections.Counter(), 0
    for mistake in mistakes:
        report = ours(mistake.function)
        verdicts["mistake", report.verdict] += 1
        is_right = report.verdict == "wrong" and is_named(report, mistake.kind)
        named += is_right
        if not is_right:
            print(f"{mistake.name}: {report.verdict}, {report.likeness}", file=sys.stderr)
    for function in rights:
        report = ours(function)
        verdicts["right", report.verdict] += 1
        if not report:
            print(f"{function.name} ({function.hard}): {report}", file=sys.stderr)
    caught, accused = verdicts["mistake", "wrong"], verdicts["right", "wrong"]
    unsure = [verdicts[kind, "inconclusive"] for kind in ("mistake", "right")]
    missed = len(mistakes) - caught - unsure[0]
    return f"| Spring Oracle | none to choose | {caught} | {missed} | {unsure[0]} | {accused} | {unsure[1]} | {named} |"


if __name__ == "__main__":
    main()
