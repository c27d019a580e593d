"""Every public thing says what it is, and every example in a docstring is true."""

from __future__ import annotations

import ast
import doctest
import importlib
import inspect
import itertools
import pkgutil
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import cfmkit

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.lists

ROOT = Path(__file__).parents[2]


def module_names() -> list[str]:
    found = (item.name for item in pkgutil.walk_packages(cfmkit.__path__, "cfmkit."))
    left_out = ("__main__", "._march")  # what is compiled of C has no text
    return ["cfmkit", *(name for name in found if not name.endswith(left_out))]


def source_of(name: str) -> str:
    """Return the text of a module of the package, which is not imported."""
    home = Path(cfmkit.__file__).parent.joinpath(*name.split(".")[1:])
    file = home / "__init__.py" if home.is_dir() else home.with_suffix(".py")
    return file.read_text(encoding="utf-8")


MODULES = module_names()
WITH_EXAMPLES = [name for name in MODULES if ">>> " in source_of(name)]


def public(module):
    """Yield the public functions and classes that a module defines, and the public methods of the classes."""
    for name, item in vars(module).items():
        if name.startswith("_") or getattr(item, "__module__", None) != module.__name__:
            continue
        if inspect.isclass(item):
            yield name, item
            yield from ((f"{name}.{key}", member) for key, member in vars(item).items() if is_method(key, member))
        elif inspect.isfunction(item):
            yield name, item


def is_method(name, member):
    return not name.startswith("_") and (inspect.isfunction(member) or isinstance(member, property | classmethod))


def test_everything_public_is_documented():
    for name in MODULES:
        module = importlib.import_module(name)
        assert (module.__doc__ or "").strip() or not inspect.getsource(module).strip(), name
        for label, item in public(module):
            text = inspect.getdoc(item) if not isinstance(item, property) else inspect.getdoc(item.fget)
            assert text, f"{name}.{label}"
            assert text.strip().splitlines()[0].rstrip().endswith((".", "::", ":")), (
                f"{name}.{label}: {text.splitlines()[0]}"
            )


def named_in(text: str, heading: str) -> set[str]:
    """Return the names that a section of a docstring is about; none where there is no such section."""
    found = re.search(rf"^{heading}\n-+\n(.*?)(?=^\S.*\n-+\n|\Z)", text, re.M | re.S)
    heads = re.findall(r"^\S.*", found[1], re.M) if found else []
    return {name.strip(" *") for head in heads for name in re.split(r" :(?: |$)", head)[0].split(",")}


def taken_by(function: ast.FunctionDef) -> set[str]:
    """Return the parameters of a function that a caller names."""
    given = function.args
    every = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    return {one.arg for one in every if one and one.arg not in ("self", "cls") and not one.arg.startswith("_")}


def fields_of(item: ast.ClassDef) -> set[str]:
    """Return the fields of a class that have no text of their own below them."""
    below = itertools.zip_longest(item.body, item.body[1:])
    fields = [one for one, text in below if isinstance(one, ast.AnnAssign) and not isinstance(text, ast.Expr)]
    return {name for one in fields if not (name := ast.unparse(one.target)).startswith("_")}


def sections_of(item: ast.FunctionDef | ast.ClassDef, classes: dict[str, ast.ClassDef]) -> Iterator[str]:
    """Yield what sections of a docstring leave out, and what they are about that is not there."""
    text = ast.get_docstring(item) or ""
    parameters, attributes = named_in(text, "Parameters"), named_in(text, "Attributes")
    if isinstance(item, ast.ClassDef):
        methods = {one.name: one for one in item.body if isinstance(one, ast.FunctionDef)}
        taken = taken_by(methods["__init__"]) if "__init__" in methods else fields_of(item)
        bases = [classes[base.id] for base in item.bases if isinstance(base, ast.Name) and base.id in classes]
        known = {*methods, *fields_of(item)}.union(*map(fields_of, bases))
        stored = (one for one in ast.walk(item) if isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Store))
        if attributes:
            yield from (fields_of(item) - attributes) | (attributes - known - {one.attr for one in stored})
    else:
        taken = taken_by(item)
    if parameters:
        yield from parameters ^ taken


def test_a_section_that_leaves_out_or_invents_a_name_is_reported():
    text = 'def f(a, b):\n    """F.\n\n    Parameters\n    ----------\n    a : int\n    c : int\n    """'
    (item,) = ast.parse(text).body
    assert {word.split()[0] for word in sections_of(item, {})} == {"b", "c"}


def test_sections_of_docstrings_are_about_all_that_there_is_and_nothing_else():
    wrong = []
    for name in MODULES:
        source = source_of(name)
        if re.search(r"^ +(Parameters|Attributes)\n", source, re.M):
            tree = ast.parse(source)
            classes = {one.name: one for one in tree.body if isinstance(one, ast.ClassDef)}
            methods = (one for item in classes.values() for one in item.body)
            items = (one for one in [*tree.body, *methods] if isinstance(one, ast.FunctionDef | ast.ClassDef))
            wrong += [f"{name}: {item.name}: {word}" for item in items for word in sections_of(item, classes)]
    assert wrong == []


def test_fields_are_described_where_they_are_declared_but_in_public_types():
    public_types = {name for name in cfmkit.__all__ if isinstance(getattr(cfmkit, name), type)}
    wrong = []
    for name in MODULES:
        for item in ast.walk(ast.parse(source_of(name))):
            if isinstance(item, ast.ClassDef) and item.name not in public_types:
                listed = named_in(ast.get_docstring(item) or "", "Attributes")
                wrong += [f"{name}: {item.name}.{field}" for field in sorted(listed & fields_of(item))]
    assert wrong == []


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_in_docstrings_are_true(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    module = importlib.import_module(name)
    failed, _ = doctest.testmod(module, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert failed == 0


def test_the_public_names_exist_and_are_listed():
    assert set(cfmkit.__all__) <= set(dir(cfmkit))
    for name in cfmkit.__all__:
        assert getattr(cfmkit, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'simulate'"):
        cfmkit.simulate  # noqa: B018


def test_the_public_names_of_a_module_stand_at_its_end_and_leave_out_nothing_that_it_defines():
    for name in MODULES:
        source = source_of(name)
        if any(other.startswith(f"{name}.") for other in MODULES) or "\n__all__ = " not in source:
            continue
        *body, last = ast.parse(source).body
        assert ast.unparse(last).startswith("__all__ = "), name
        defined = {one.name for one in body if isinstance(one, ast.FunctionDef | ast.ClassDef)}
        assert {one for one in defined if not one.startswith("_")} <= set(ast.literal_eval(last.value)), name


@pytest.mark.parametrize("folder", sorted((ROOT / "cfmkit").rglob("__init__.py")), ids=lambda path: path.parent.name)
def test_what_a_folder_says_of_its_files_names_files_that_there_are(folder):
    """A word in backticks is a file of the folder, or something that one of them defines or the folder exports."""
    text = folder.read_text(encoding="utf-8")
    files = [path for path in folder.parent.iterdir() if path != folder]
    code = "\n".join(path.read_text(encoding="utf-8") for path in files if path.suffix == ".py")
    words = set(re.findall(r"(?<!`)`([a-z][a-z_]{2,})`(?!`)", ast.get_docstring(ast.parse(text)) or ""))
    known = {path.stem for path in files} | set(re.findall(r'^    "([a-z_]+)",$', text, re.M))
    assert {word for word in words - known if not re.search(rf"\bdef {word}\(|^{word}\b.*=", code, re.M)} == set()


def test_a_reference_in_a_docstring_names_a_module_and_something_that_it_defines():
    """Of words in backticks, joined by dots, whose last is a class; or that begin with the package."""
    modules: dict[str, str] = {}
    for path in (ROOT / "cfmkit").rglob("*.py"):
        name = path.parent.name if path.name == "__init__.py" else path.stem
        modules[name] = modules.get(name, "") + path.read_text(encoding="utf-8")
    known = set(modules) | {"xarray", "pandas", "configs"}
    lost = set()
    for text in modules.values():
        for reference in re.findall(r"`((?:[a-z_]+\.)+[A-Z]\w+|cfmkit(?:\.\w+)+)`", text):
            words = reference.split(".")
            place = max((k for k, word in enumerate(words) if word in known), default=-1)
            named = words[place + 1 : place + 2]
            if place < 0 or not all(re.search(rf"\b{one}\b", modules.get(words[place], one)) for one in named):
                lost.add(reference)
    assert lost == set()
