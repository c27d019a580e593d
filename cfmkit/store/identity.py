"""Names for content: two things with the same hash are the same thing."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from cfmkit.errors import CfmError

if TYPE_CHECKING:
    from pathlib import Path


def file_hash(path: Path) -> str | None:
    """Return the SHA-256 of an ordinary file, or None if there is none (a link does not count)."""
    if path.is_symlink() or not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def stable_hash(value: Any) -> str:
    """Return the SHA-256 of a value's canonical JSON: the same on every machine and in every run.

    Mappings count by content, not by order; tuples, lists and arrays are the same;
    -0.0 is 0.0. An integer is not the float of the same size, nor a truth value.

    Parameters
    ----------
    value : Any
        None, truth values, numbers, texts, and sequences and mappings of them.

    Raises
    ------
    cfmkit.errors.CfmError
        If there is something else inside, or a number that is not finite.

    Examples
    --------
    >>> stable_hash({"a": 1, "b": [2.5]}) == stable_hash({"b": (2.5,), "a": 1})
    True
    """
    text = json.dumps(_canonical(value), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _canonical(value: Any) -> Any:
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise CfmError(f"{value} has no identity: only finite numbers have")
        return value + 0.0
    if isinstance(value, Mapping):
        if odd := [key for key in value if not isinstance(key, str)]:
            raise CfmError(f"{odd[0]!r} is a key that is no text: it has no identity")
        return {key: _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    if hasattr(value, "tolist"):  # numpy's scalars and arrays, without importing numpy
        return _canonical(value.tolist())
    raise CfmError(f"a {type(value).__name__} has no identity: only texts, numbers and their collections have")
