"""Files that come with the package: examples, listed and copied, and drawings of families with their dimensions named.

In the tree the examples, published designs, starting points and studies with their data, are the folder `configs`; a
wheel has the same files as the package `cfmkit.configs`. A dimension drawing comes with the package of its family: each
text of the class ``row`` in the SVG is a row of the table of dimensions, a `tspan` with the symbol, one with the key of
the specification, and the lines of what it is.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from string import ascii_uppercase
from typing import TYPE_CHECKING

from cfmkit.errors import OutputError, UsageError, visible
from cfmkit.runs.shipped_folders import shipped_folder

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable

    from cfmkit.families.base import Family


@dataclass(frozen=True)
class Example:
    """One example."""

    name: str  # path below the folder of all, without its ending: ``cam``, ``studies/cam_tolerance``
    family: str  # as the file says
    about: str  # what it is: the first sentence of the file's comment
    path: Path  # the file
    # whether `design` searches for its shape from many starts, which takes minutes; all others take seconds
    searches: bool = False


ABBREVIATED_WORDS = ("sec.", "eqs.", "figs.")


def folder() -> Path:
    """Return the folder of all examples.

    Raises UsageError if this installation has none.
    """
    return shipped_folder("configs", "cam.yaml")


def examples() -> tuple[Example, ...]:
    """Return every example, those of the top folder first, by name.

    Examples
    --------
    >>> import cfmkit
    >>> cfmkit.examples()[0].name, len({example.family for example in cfmkit.examples()})
    ('beam_cantilever', 4)
    """
    root = folder()
    files = sorted(root.rglob("*.yaml"), key=lambda path: (len(path.parts), path))
    return tuple(_read_example(path, root) for path in files)


def _read_example(path: Path, root: Path) -> Example:
    lines = path.read_text(encoding="utf-8").splitlines()
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("family:"))
    head = takewhile(lambda line: line.startswith("#"), lines)
    comment = " ".join(line.removeprefix("#").strip() for line in head)
    family = next(named, "")
    name = path.relative_to(root).with_suffix("").as_posix()
    searches = any(line.strip() == "optimise:" for line in lines)
    return Example(name, family, _first_sentence(comment), path, searches)


def _first_sentence(text: str) -> str:
    """Return a text up to its first full stop that ends a sentence; initials, "Eq." and "sec." end none.

    Examples
    --------
    >>> _first_sentence("Li, B. and Hao 2019, sec. 4: a spring. `cfmkit sweep x.yaml` draws it.")
    'Li, B. and Hao 2019, sec. 4: a spring.'
    """
    words = text.split()
    for at, word in enumerate(words[:-1]):
        if word[-1] != "." or len(word) < 4 or word in ABBREVIATED_WORDS:
            continue
        plain = word[:-1].isalpha() and word.islower()
        after_number = (word[-2].isdigit() or word[-2] == ")") and words[at + 1][0] in ascii_uppercase
        if plain or after_number or words[at + 1][0] == "`":
            return " ".join(words[: at + 1])
    return " ".join(words)


def example(name: str) -> Example:
    """Return one example by its name, with or without its folder and its ending.

    Raises UsageError if there is none of that name.
    """
    listed = examples()
    files = {file.path.stem: file for file in listed} | {file.name: file for file in listed}
    wanted = name.removesuffix(".yaml")
    if wanted in files:
        return files[wanted]
    from cfmkit.specs.yamlio import did_you_mean

    hint = did_you_mean(wanted, list(files)) or "`cfmkit examples` lists them"
    raise UsageError(f"there is no example {visible(name)!r}; {hint}")


def copy(name: str, out: str | os.PathLike[str] = ".", schema: bool = False) -> tuple[Path, ...]:
    """Copy an example with the data files that it names, and return what was written; nothing is replaced.

    With `schema` it gets the line by which editors find the schema of its family, and that file, which may be replaced.

    Raises UsageError if there is no example of that name; OutputError if a file is there already, or cannot be written.
    """
    from cfmkit import api
    from cfmkit.families import family
    from cfmkit.runs.editor_schema import write_schema
    from cfmkit.specs.data_file_paths import list_data_files
    from cfmkit.store.safe_disk_changes import discard, make_folders, remove_empty, reporting, write_new

    chosen = example(name)
    target = Path(out) / chosen.path.name
    data = sorted({str(source): source.path for source in list_data_files(api.load(chosen.path).model_dump())}.items())
    # what is there already and says the same stays: two examples may name the same data
    missing = [(text, path) for text, path in data if not _is_same_file(target.parent / text, path)]
    wanted = {target: chosen.path, **{target.parent / text: path for text, path in missing}}
    _refuse_taken(wanted)
    written: list[Path] = []
    made: list[Path] = []
    try:
        for place, source in wanted.items():
            with reporting(place):
                made += make_folders(place.absolute().parent)
                write_new(place, source.read_bytes() if place != target else _example_text(chosen, schema))
            written.append(place)
        if schema:
            written.append(write_schema(target, family(chosen.family)))
    except OutputError:
        for place in written:
            discard(place)
        remove_empty(made)
        raise
    return tuple(written)


def _example_text(chosen: Example, schema: bool) -> bytes:
    """Return an example's text for the folder it is copied to, with the line for editors where that is requested."""
    from cfmkit.families import family
    from cfmkit.runs.editor_schema import with_line

    # commands in the comments call the files as they lie in the tree; a copy has its data below its own folder
    above = chosen.name.rpartition("/")[0]
    text = re.sub(rf"\bconfigs/(?:{re.escape(above)}/)?", "", chosen.path.read_bytes().decode())
    return (with_line(text, family(chosen.family)) if schema else text).encode()


def _is_same_file(place: Path, source: Path) -> bool:
    """Return whether a file is there already with the same content, but for its comments if it is a specification."""
    if not place.is_file():
        return False
    texts = [path.read_bytes() for path in (place, source)]
    if source.suffix == ".yaml":
        texts = [b"\n".join(line for line in text.splitlines() if not line.startswith(b"#")) for text in texts]
    return texts[0] == texts[1]


def _refuse_taken(places: Iterable[Path]) -> None:
    for place in places:
        if place.exists() or place.is_symlink():
            raise OutputError(f"cannot write {visible(str(place))}: the file exists")


DRAWING_FILE = "dimensions.svg"
DRAWING_SUFFIXES = (".png", ".svg", ".pdf")


def find_drawn_family(name: str | None) -> Family:
    """Return the family of that name, which has a drawing.

    Raises UsageError if there is no such family, or it has no drawing.
    """
    from cfmkit.families import family, records

    names = ", ".join(record.name for record in records() if record.file(DRAWING_FILE))
    if name is None:
        raise UsageError(f"--figure needs a family: {names}")
    record = family(name)
    if not record.file(DRAWING_FILE):
        raise UsageError(f"the family {visible(name)!r} has no drawing; there are {names}")
    return record


def read_drawing(record: Family) -> dict[str, bytes]:
    """Return the drawing of a family by the ending of its file: ``.svg``, and those of `DRAWING_SUFFIXES` there."""
    stem = DRAWING_FILE.removesuffix(".svg")
    files = {ending: record.file(stem + ending) for ending in DRAWING_SUFFIXES}
    return {ending: file.read_bytes() for ending, file in files.items() if file is not None}


def read_dimensions(record: Family) -> list[dict[str, str]]:
    """Return ``symbol``, ``key`` of the specification and ``meaning`` of each row of the drawing's table.

    Raises UsageError if the drawing is no SVG, or a row has no symbol or key.
    """
    from xml.etree import ElementTree

    rows = []
    try:
        for text in ElementTree.fromstring(record.read(DRAWING_FILE)).iterfind(".//{*}text[@class='row']"):
            symbol, key, *meaning = ("".join(part.itertext()) for part in text)
            rows.append({"symbol": symbol, "key": key, "meaning": " ".join(meaning)})
    except (ElementTree.ParseError, ValueError) as error:
        raise UsageError(f"{record.folder}/{DRAWING_FILE} has no rows of symbol, key, meaning: {error}") from None
    return rows
