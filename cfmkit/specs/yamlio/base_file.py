"""``base: other.yaml``: a specification that says only what differs from another one.

Values of the file override those of its base, key by key; lists and single values replace those of the base as a whole.
A base may have a base itself. It lies in the folder of the specification or below, like every file that one names.
"""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cfmkit.errors import SpecError, reason_of, visible
from cfmkit.specs.yamlio.document import read_document
from cfmkit.specs.yamlio.tree_builder import MAX_FILE_BYTES

if TYPE_CHECKING:
    from cfmkit.specs.yamlio.document import YamlDocument

BASE_KEY = "base"
MAX_FILES = 16  # in a chain of bases: more are a mistake
_BASE_KEY = re.compile(rb"^(\xef\xbb\xbf)?[\"']?base[\"']?\s*:", re.MULTILINE)


def with_base(
    document: YamlDocument,  # as read; its folder is where its base is looked for
    above: tuple[str, ...] = (),  # real paths of the files that name this one, the first of them first
) -> YamlDocument:
    """Return a document with the values of its base where it has none of its override; as it is if it names none.

    Raises SpecError if the base cannot be read, is no specification, or the files name each other; with the place in
    the right file.
    """
    if not isinstance(document.tree, dict) or BASE_KEY not in document.tree:
        return document
    named = document.tree[BASE_KEY]
    path, fault = _path_of(document, named, above)
    if path is None:
        raise SpecError([*document.problems, document.problem((BASE_KEY,), fault)])
    source = os.path.join(os.path.dirname(document.source), named)
    try:
        with path.open("rb") as file:
            data = file.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise SpecError(
            [document.problem((BASE_KEY,), f"{visible(named)} cannot be read: {reason_of(error)}")]
        ) from None
    base = read_document(data, source, path.parent)
    if not isinstance(base.tree, dict) or base.is_broken:
        raise SpecError([*document.problems, *base.problems])
    base = with_base(base, (*above, os.path.realpath(document.path)))
    override = {key: value for key, value in document.tree.items() if key != BASE_KEY}
    tree = merge(base.tree, override)
    return dataclasses.replace(document, tree=tree, base=base, problems=(*document.problems, *base.problems))


def _path_of(document: YamlDocument, named: Any, above: tuple[str, ...]) -> tuple[Path | None, str]:
    """Return the path of a base and "", or None and the fault."""
    if document.folder is None:
        return None, "a base is looked for beside the file that names it, and this text is in no file"
    if not isinstance(named, str) or not named.strip() or "\0" in named:
        return None, "must be the name of a YAML file, e.g. base: common.yaml"
    root, path = os.path.realpath(document.folder), os.path.realpath(document.folder / named)
    if os.path.isabs(named) or os.path.commonpath([root, path]) != root:
        return None, "must be a file in the folder of the specification, or below it"
    chain = [*above, os.path.realpath(document.path)]
    if path in chain:
        circle = [*chain[chain.index(path) :], path]
        return None, f"these files name each other: {' -> '.join(visible(os.path.basename(file)) for file in circle)}"
    if len(chain) >= MAX_FILES:
        return None, f"more than {MAX_FILES} files in a chain of bases"
    if not os.path.isfile(path):
        return None, f"there is no file {visible(named)!r} in the folder of the specification"
    return Path(document.folder) / named, ""


def merge(base: Any, override: Any) -> Any:
    """Return a tree with the values of `override` over those of its base.

    Examples
    --------
    >>> merge({"a": {"b": 1, "c": 2}, "d": (1, 2)}, {"a": {"c": 3}, "d": (4,)})
    {'a': {'b': 1, 'c': 3}, 'd': (4,)}
    """
    if not isinstance(base, dict) or not isinstance(override, dict):
        return override
    return {
        key: merge(base[key], override[key]) if key in base and key in override else {**base, **override}[key]
        for key in {**base, **override}
    }


def base_files(path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """Return the files that a specification takes values from, the nearest first; without those that cannot be read."""
    files: list[Path] = []
    file = Path(path)
    while len(files) < MAX_FILES:
        try:
            data = file.read_bytes()
        except (OSError, ValueError):
            break
        tree = read_document(data, "", file.parent).tree if _BASE_KEY.search(data) else None
        named = tree.get(BASE_KEY) if isinstance(tree, dict) else None
        if not isinstance(named, str) or not named or "\0" in named:
            break
        file = file.parent / named
        files.append(file)
    return tuple(files)
