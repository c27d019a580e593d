"""Count how many small faults in the product a selection of tests notices.

    python tools/mutants.py cfmkit/families/cam -n 25 --seed 1 -- tests/cam

Puts one random fault at a time into a copy of the tree (an operator, a comparison, ``and``/``or``, a constant, a
condition negated, ``min`` for ``max``) and runs the tests there until one fails. Prints each fault with the test that
noticed it, then the share. A fault that survives is a gap in the tests, or changes nothing that can be seen (a
tolerance, a guess to start from): read it before writing a test. What follows ``--`` goes to pytest;
``--only 3,7`` repeats some faults of the same seed.

mutmut and cosmic-ray list all faults of a package and run each; neither draws some of them by a seed.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SWAPPED_OPERATORS: dict[type, list[type]] = {
    ast.Add: [ast.Sub],
    ast.Sub: [ast.Add],
    ast.Mult: [ast.Div],
    ast.Div: [ast.Mult],
    ast.Lt: [ast.LtE, ast.Gt],
    ast.LtE: [ast.Lt, ast.GtE],
    ast.Gt: [ast.GtE, ast.Lt],
    ast.GtE: [ast.Gt, ast.LtE],
    ast.Eq: [ast.NotEq],
    ast.NotEq: [ast.Eq],
    ast.And: [ast.Or],
    ast.Or: [ast.And],
}


def mutate(node: ast.AST, rng: random.Random) -> ast.AST | None:
    """Return a changed copy of one node of a syntax tree, None if there is no fault for it."""
    changed = copy.deepcopy(node)
    match changed:
        case ast.BinOp() | ast.BoolOp() | ast.AugAssign() if type(changed.op) in SWAPPED_OPERATORS:
            changed.op = rng.choice(SWAPPED_OPERATORS[type(changed.op)])()
        case ast.Compare() if type(changed.ops[0]) in SWAPPED_OPERATORS:
            changed.ops[0] = rng.choice(SWAPPED_OPERATORS[type(changed.ops[0])])()
        case ast.Constant() if type(changed.value) in (int, float):
            shifted = isinstance(changed.value, int) or changed.value == 0.0
            changed.value = changed.value + 1 if shifted else changed.value * 1.01
        case ast.If() | ast.IfExp() | ast.While() if "TYPE_CHECKING" not in ast.unparse(changed.test):
            changed.test = ast.UnaryOp(ast.Not(), changed.test)
        case ast.Call(args=[_, _]) if re.search(r"\b(min|max)(imum)?$", ast.unparse(changed.func)):
            name = ast.unparse(changed.func)
            swapped = name.replace("min", "max") if "min" in name else name.replace("max", "min")
            changed.func = ast.parse(swapped, mode="eval").body
        case _:
            return None
    return changed


class Replacement(ast.NodeTransformer):
    """Puts one node in the place of another."""

    def __init__(self, node: ast.AST, changed: ast.AST) -> None:
        """Take the node and what stands there instead."""
        self.node, self.changed = node, changed

    def visit(self, node: ast.AST) -> ast.AST:
        """Return the replacement of the node, or what it holds with the replacement inside."""
        return self.changed if node is self.node else self.generic_visit(node)


def draw(paths: list[Path], n: int, seed: int) -> list[tuple[Path, str, str]]:
    """Return file, description and changed text of random faults; each place of the code is as likely as another."""
    rng = random.Random(seed)
    trees = [(path, ast.parse(path.read_text(encoding="utf-8"))) for path in paths]
    places = [(path, tree, node) for path, tree in trees for node in ast.walk(tree) if mutate(node, rng)]
    faults = []
    for path, tree, node in rng.sample(places, n):
        changed = mutate(node, rng)
        first, second = (ast.unparse(getattr(each, "test", each)).splitlines()[0] for each in (node, changed))
        text = ast.unparse(Replacement(node, changed).visit(copy.deepcopy(tree, {id(node): node})))
        faults.append((path, f"{path}:{node.lineno}  {first}  ->  {second}", text))
    return faults


def run(tree: Path, tests: list[str], seconds: float) -> str:
    """Return the name of the first test that fails in a tree, "" if none does."""
    environment = os.environ | {"PYTHONPATH": str(tree)}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        ended = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return "time limit"
    lines = [line for line in ended.stdout.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    return "" if ended.returncode == 0 else (lines or ["failed"])[0].split(" - ")[0]


def main() -> None:
    """Draw faults, run the tests on each, print what was caught."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packages", nargs="+", help="folders or files of the product in which faults are drawn")
    parser.add_argument("-n", type=int, default=20, help="how many faults")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--seconds", type=float, default=120.0, help="time limit of one run; running into it counts as caught"
    )
    parser.add_argument("--only", default="", help="numbers of the faults to run, separated by commas")
    end = sys.argv.index("--")
    options, tests = parser.parse_args(sys.argv[1:end]), sys.argv[end + 1 :]
    os.chdir(ROOT)
    paths = sorted(
        file
        for name in options.packages
        for file in ([Path(name)] if name.endswith(".py") else Path(name).rglob("*.py"))
    )
    numbers = [int(number) for number in options.only.split(",") if number] or range(1, options.n + 1)
    faults = draw(paths, options.n, options.seed)
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".git", ".venv", "build", "*_cache"))
        if failed := run(tree, tests, 10 * options.seconds):
            sys.exit(f"without a fault: {failed}")
        n_caught = 0
        for number in numbers:
            path, description, text = faults[number - 1]
            original = (tree / path).read_text(encoding="utf-8")
            stamp = time.time()
            for content in (text, original):  # the time of the file tells Python that its compiled copy is out of date
                (tree / path).write_text(content, encoding="utf-8")
                stamp += 10.0
                os.utime(tree / path, (stamp, stamp))
                if content is text:
                    start = time.time()
                    catcher = run(tree, tests, options.seconds)
            n_caught += bool(catcher)
            print(f"{number:3} {time.time() - start:4.0f} s  {description}\n      {catcher or 'SURVIVES'}", flush=True)
    print(f"caught: {n_caught} of {len(numbers)}")


if __name__ == "__main__":
    main()
