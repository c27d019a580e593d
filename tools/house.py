"""The house in figures: files, lines, knots of modules, and names that mean more than one thing.

    python tools/house.py                    # a table, and every knot with the imports that tie it
    python tools/house.py --json             # the same for a program
    python tools/house.py --at-most-knots 3  # exit code 1 where there are more
    python tools/house.py --names            # names and sentences that break a rule; exit code 1 where there are more
                                             # than tools/names.json allows

A knot is a strongly connected set of modules in the graph of *all* imports: those at the top of a file, inside
functions and for types alone. A string that is exactly the dotted name of a module (``"cfmkit.families.cam.model"``,
also with ``:function`` behind it) counts as an import of it: looking a module up by its name does not untie a knot.
An f-string that begins with the name of the package, or with ``module.__name__``, counts as an import of every module
that it can name. Importing ``cfmkit.a.b`` ties a file to ``b``, not to ``cfmkit/a/__init__.py``.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import sys
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def modules(package: Path) -> dict[str, Path]:
    """Return dotted name -> file of every module below a package."""
    found = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def formatted(node: ast.JoinedStr, aliases: dict[str, str]) -> str:
    """Return a pattern for what an f-string may be; of ``module.__name__`` the name of that module."""
    parts = []
    for part in node.values:
        value = part.value
        if isinstance(part, ast.Constant):
            parts.append(re.escape(str(value)))
        elif (
            isinstance(value, ast.Attribute)
            and value.attr == "__name__"
            and isinstance(value.value, ast.Name)
            and value.value.id in aliases
        ):
            parts.append(re.escape(aliases[value.value.id]))
        else:
            parts.append(r"[\w.]+")
    return "".join(parts).split(":")[0]


def looked_up(tree: ast.AST, known: dict[str, Path]) -> set[str]:
    """Return the modules among the known ones that f-strings in a syntax tree can name."""
    package = min(known, key=len)
    aliases = {
        alias.asname or alias.name: f"{node.module}.{alias.name}" if isinstance(node, ast.ImportFrom) else alias.name
        for node in ast.walk(tree)
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for alias in node.names
    }
    patterns = [formatted(node, aliases) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)]
    own = [re.compile(one) for one in patterns if one.startswith(re.escape(f"{package}."))]
    return {name for name in known for one in own if one.fullmatch(name)}


def imported(tree: ast.AST, known: dict[str, Path]) -> set[str]:
    """Return the modules among the known ones that a syntax tree imports or names in a string."""
    found = set()
    loggers = {
        id(argument)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        for argument in node.args
        if ast.unparse(node.func).endswith("getLogger")
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found.add(inner if inner in known else node.module)
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and "." in node.value
            and id(node) not in loggers
        ):
            found.add(node.value.split(":")[0])
    return (found & set(known)) | looked_up(tree, known)


def knots(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the strongly connected sets of two or more nodes, the largest first (Tarjan, without recursion)."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found = []
    for start in graph:
        if start in order:
            continue
        order[start] = low[start] = len(order)
        stack.append(start)
        work = [(start, iter(sorted(graph[start])))]
        while work:
            node, rest = work[-1]
            for child in rest:
                if child not in order:
                    order[child] = low[child] = len(order)
                    stack.append(child)
                    work.append((child, iter(sorted(graph[child]))))
                    break
                if child in stack:
                    low[node] = min(low[node], order[child])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == order[node]:
                    place = stack.index(node)
                    members, stack[place:] = sorted(stack[place:]), []
                    if len(members) > 1:
                        found.append(members)
    return sorted(found, key=lambda members: (-len(members), members))


def single_use(trees: dict[str, ast.AST]) -> int:
    """Return how many private functions are named exactly once besides their definition."""
    defined: Counter[str] = Counter()
    used: Counter[str] = Counter()
    for tree in trees.values():
        for node in ast.walk(tree):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and node.name.startswith("_"):
                defined[node.name] += not node.name.startswith("__")
            elif isinstance(node, ast.Name):
                used[node.id] += 1
            elif isinstance(node, ast.Attribute):
                used[node.attr] += 1
    return sum(1 for name, count in defined.items() if count == 1 and used[name] == 1)


def shared_classes(texts: dict[str, str]) -> dict[str, list[str]]:
    """Return the names of classes that several modules have, with these."""
    classes: dict[str, list[str]] = defaultdict(list)
    for name, text in texts.items():
        for found in re.findall(r"^ *class (\w+)[(:\[]", text, re.MULTILINE):
            classes[found].append(name)
    return {name: homes for name, homes in sorted(classes.items()) if len(homes) > 1}


def survey(package: Path) -> dict[str, object]:
    """Return the figures of a package."""
    known = modules(package)
    texts = {name: path.read_text(encoding="utf-8") for name, path in known.items()}
    trees = {name: ast.parse(text) for name, text in texts.items()}
    graph = {name: imported(tree, known) - {name} for name, tree in trees.items()}
    importers: Counter[str] = Counter(target for targets in graph.values() for target in targets)
    top = [path for path in package.iterdir() if path.name != "__pycache__"]
    tied = knots(graph)
    return {
        "files": len(known),
        "lines": sum(text.count("\n") for text in texts.values()),
        "top_folders": sum(path.is_dir() for path in top),
        "top_files": sum(path.suffix == ".py" for path in top),
        "modules_with_one_importer": sum(1 for count in importers.values() if count == 1),
        "private_functions_used_once": single_use(trees),
        "class_names_in_several_modules": shared_classes(texts),
        "knots": tied,
        "ties": [[f"{a} -> {b}" for a in members for b in sorted(graph[a] & set(members))] for members in tied],
    }


def table(figures: dict[str, object]) -> str:
    """Return the figures as text."""
    lines = [f"{key.replace('_', ' '):32}{value:>8}" for key, value in figures.items() if isinstance(value, int)]
    shared = figures["class_names_in_several_modules"]
    lines.append(f"{'class names in several modules':32}{len(shared):>8}")
    lines += [f"    {name}: {', '.join(homes)}" for name, homes in shared.items()]
    lines.append(f"{'knots':32}{len(figures['knots']):>8}")
    for members, ties in zip(figures["knots"], figures["ties"], strict=True):
        lines += [f"  {len(members)} modules", *(f"    {tie}" for tie in ties)]
    return "\n".join(lines)


PREPOSITIONS = {
    "about", "above", "across", "after", "against", "along", "around", "as", "at", "before", "behind", "below",
    "beside", "between", "beyond", "by", "down", "during", "for", "from", "in", "inside", "into", "of", "off", "on",
    "onto", "out", "outside", "over", "past", "through", "to", "toward", "towards", "under", "until", "up", "upon",
    "via", "with", "within", "without",
}  # fmt: skip
IRREGULAR_PARTICIPLES = {
    "begun", "bent", "borne", "bought", "broken", "built", "chosen", "done", "drawn", "driven", "fallen",
    "felt", "found", "given", "gone", "grown", "heard", "held", "kept", "known", "laid", "left", "lost", "made",
    "meant", "met", "said", "seen", "shown", "sold", "spent", "spoilt", "stuck",
    "sunk", "taken", "thought", "thrown", "told", "torn", "turned", "understood", "wound", "written",
}  # fmt: skip
PRONOUNS = {
    "each", "found", "given", "here", "known", "near", "one", "other", "own", "there", "way",
}  # fmt: skip
FORBIDDEN_BEGINNINGS = ("What ", "How ", "Where ", "Tell ", "Say ")
CONVERSIONS = {"as_", "from_", "to_", "with_"}
"""First words that are prepositions in the usual names of constructors and conversions: ``from_yaml``, ``to_csv``."""


def is_participle(word: str) -> bool:
    """Return True if a word by itself is a participle: ``judged``, ``held``."""
    return word in IRREGULAR_PARTICIPLES or (
        len(word) > 4 and word.endswith("ed") and not word.endswith(("eed", "bed"))
    )


def is_property(node: ast.FunctionDef) -> bool:
    """Return True if a function is a property, which a noun or an adjective names."""
    names = {getattr(one, "id", getattr(one, "attr", "")) for one in node.decorator_list}
    return not names.isdisjoint({"property", "cached_property", "setter"})


def rule_of_function(node: ast.FunctionDef) -> str | None:
    """Return the rule that the name of a function breaks; None if it breaks none."""
    words = node.name.strip("_").split("_")
    if is_property(node) or node.name.startswith("__"):
        return None
    if len(words) == 1 and is_participle(words[0]):
        return "functions named by a participle"
    if len(words) == 1 and words[0] in PRONOUNS:
        return "functions named by a pronoun"
    begins = f"{words[0]}_"
    if words[0] in PREPOSITIONS and not (begins in CONVERSIONS and len(words) > 1):
        return "functions named by a preposition"
    return None


def broken_rules(trees: dict[str, ast.Module]) -> tuple[Counter[str], dict[str, list[str]]]:
    """Return how often each rule for names and sentences is broken, and the public functions that break one."""
    counts: Counter[str] = Counter()
    public: dict[str, list[str]] = defaultdict(list)
    for module, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                counts["functions"] += 1
                if rule := rule_of_function(node):
                    counts[rule] += 1
                    if not node.name.startswith("_"):
                        counts["public functions that break a rule"] += 1
                        public[rule].append(f"{module}.{node.name}")
            if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module):
                text = ast.get_docstring(node) or ""
                counts["docstrings that begin with What, How, Where or Tell"] += text.startswith(FORBIDDEN_BEGINNINGS)
                counts["sections 'Attributes'"] += "\nAttributes\n---" in text
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id in PRONOUNS:
                counts["variables that are pronouns"] += 1
            if isinstance(node, ast.arg) and node.arg in PRONOUNS:
                counts["variables that are pronouns"] += 1
        for node in tree.body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            for name in (
                one.id for target in targets for one in ast.walk(target or ast.Pass()) if isinstance(one, ast.Name)
            ):
                if name.isupper() and "_" not in name.strip("_"):
                    counts["constants of one word"] += 1
    return counts, public


def names_report(package: Path, *, as_json: bool) -> int:
    """Print how often each rule is broken, and what is allowed; return 1 where it is more than that."""
    trees = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in modules(package).items()}
    counts, public = broken_rules(trees)
    allowed = json.loads(ALLOWED.read_text(encoding="utf-8")) if ALLOWED.exists() else {}
    if as_json:
        print(json.dumps({"counts": counts, "public": public}, indent=1))
    else:
        for name, count in counts.items():
            print(f"{name:52}{count:>7}" + (f"   allowed {allowed[name]}" if name in allowed else ""))
    return int(any(counts[name] > most for name, most in allowed.items()))


ALLOWED = Path(__file__).with_name("names.json")
"""How often each rule may be broken: as often as on the day the file was written, and never more."""


def main() -> int:
    """Print the figures; return 1 where there are more knots, or more names against the rules, than allowed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("package", nargs="?", type=Path, default=ROOT / "cfmkit", help="folder of the package")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--at-most-knots", type=int, metavar="N", help="exit code 1 where there are more")
    parser.add_argument("--names", action="store_true", help="count names and sentences that break a rule")
    options = parser.parse_args()
    if options.names:
        return names_report(options.package, as_json=options.json)
    figures = survey(options.package)
    print(json.dumps(figures, indent=1) if options.json else table(figures))
    return int(options.at_most_knots is not None and len(figures["knots"]) > options.at_most_knots)


if __name__ == "__main__":
    sys.exit(main())
