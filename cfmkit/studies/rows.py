"""Rows of a study many at a time, and how they are written to the journal and read back."""

from __future__ import annotations

import base64
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.results import Status
from cfmkit.studies.study import Row

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.curves import FloatArray


WARNINGS_JOINT = "; "
"""Between the names of warnings in a column of a table."""

_STATUS = {status.key: status for status in Status}


@dataclass(frozen=True)
class Rows:
    """Consecutive rows of a study.

    Attributes
    ----------
    values : (n, m) array
        Metrics [SI]; NaN where there is no value.
    met : (n, r) array of bool
        Requirements; False where nothing was solved.
    odd : mapping of int to (Status, str)
        Status and message of the rows that are not complete.
    curves : mapping of int to bytes
        Curves as CSV, where they are kept.
    bugs : mapping of int to str
        Tracebacks.
    warned : mapping of str to (n,) array of bool
        Name of a warning -> the rows that have it.
    """

    values: FloatArray
    met: NDArray[np.bool_]
    odd: Mapping[int, tuple[Status, str]] = field(default_factory=dict)
    curves: Mapping[int, bytes] = field(default_factory=dict)
    bugs: Mapping[int, str] = field(default_factory=dict)
    warned: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.values)

    @property
    def failed(self) -> int:
        """Number of rows that are not complete."""
        return len(self.odd)

    @property
    def keepable(self) -> bool:
        """Whether every row is what it would be on any machine: none timed out, crashed or hit a bug."""
        return not any(status in (Status.TIMEOUT, Status.CRASHED) for status, _ in self.odd.values())

    def status(self, index: int) -> tuple[Status, str]:
        """Return status and message of one row."""
        return self.odd.get(index, (Status.COMPLETE, ""))


def gathered(rows: Sequence[Row], metrics: int, requirements: int) -> Rows:
    """Return single rows as one."""
    nothing, none_met = (math.nan,) * metrics, (False,) * requirements
    values = np.array([row.values or nothing for row in rows], dtype=np.float64).reshape(len(rows), metrics)
    met = np.array([row.met or none_met for row in rows], dtype=bool).reshape(len(rows), requirements)
    odd, curves, bugs = {}, {}, {}
    for k, row in enumerate(rows):
        if row.status is not Status.COMPLETE:
            odd[k] = row.status, row.message
        if row.curve:
            curves[k] = row.curve
        if row.bug:
            bugs[k] = row.bug
    names = sorted({name for row in rows for name in row.warnings})
    warned = {name: np.array([name in row.warnings for row in rows], dtype=bool) for name in names}
    return Rows(values, met, odd, curves, bugs, warned)


def record(rows: Rows) -> Any:
    """Return rows as the journal keeps them: numbers packed, which takes a tenth of the time of their decimals."""
    if len(rows) != 1:
        odd = {str(k): [status.key, message] for k, (status, message) in rows.odd.items()}
        told = {"n": len(rows), "v": _packed(rows.values), "q": _packed(rows.met), "o": odd}
        if rows.warned:
            told["w"] = {name: _packed(np.packbits(mask)) for name, mask in sorted(rows.warned.items())}
        return told | ({"u": {str(k): _text(curve) for k, curve in rows.curves.items()}} if rows.curves else {})
    status, message = rows.status(0)
    told = {"s": status.key}
    if message:
        told["m"] = message
    if status.usable:
        told["v"] = _packed(rows.values)
        told["q"] = "".join("01"[met] for met in rows.met[0].tolist())
    if names := [name for name, mask in sorted(rows.warned.items()) if mask[0]]:
        told["w"] = names
    if rows.curves:
        told["u"] = _text(rows.curves[0])
    return told


def recalled(told: Any, metrics: int, requirements: int) -> Rows:
    """Return the rows that a record is."""
    if "n" not in told:
        return gathered([recalled_row(told)], metrics, requirements)
    values = _unpacked(told["v"], np.float64).reshape(told["n"], metrics)
    met = _unpacked(told["q"], np.bool_).reshape(told["n"], requirements)
    curves = {int(k): _bytes(text) for k, text in told.get("u", {}).items()}
    odd = {int(k): (_STATUS[s], m) for k, (s, m) in told["o"].items()}
    masks = {
        name: np.unpackbits(_unpacked(bits, np.uint8), count=told["n"]) for name, bits in told.get("w", {}).items()
    }
    return Rows(values, met, odd, curves, warned={name: mask.astype(bool) for name, mask in masks.items()})


def recalled_row(told: Any) -> Row:
    """Return the single row that a record is."""
    curve = _bytes(told["u"]) if "u" in told else b""
    noted = tuple(_unpacked(told["v"], np.float64).tolist()) if "v" in told else ()
    met = tuple(map("1".__eq__, told.get("q", "")))
    return Row(_STATUS[told["s"]], noted, met, told.get("m", ""), curve, warnings=tuple(told.get("w", ())))


def joined(parts: Sequence[Rows]) -> Rows:
    """Return several pieces as one."""
    if len(parts) == 1:
        return parts[0]
    offsets = np.cumsum([0, *map(len, parts)]).tolist()
    pairs = list(zip(offsets, parts, strict=False))
    return Rows(
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.met for part in parts]),
        {start + k: item for start, part in pairs for k, item in part.odd.items()},
        {start + k: item for start, part in pairs for k, item in part.curves.items()},
        {start + k: item for start, part in pairs for k, item in part.bugs.items()},
        _joined_masks(parts),
    )


def _joined_masks(parts: Sequence[Rows]) -> dict[str, NDArray[np.bool_]]:
    """Return the masks of all warnings over all pieces."""
    names = sorted({name for part in parts for name in part.warned})
    return {
        name: np.concatenate([part.warned.get(name, np.zeros(len(part), dtype=bool)) for part in parts])
        for name in names
    }


def cut(rows: Rows, start: int, stop: int) -> Rows:
    """Return some of the rows."""
    if (start, stop) == (0, len(rows)):
        return rows

    def kept(items: Mapping[int, Any]) -> dict[int, Any]:
        return {k - start: item for k, item in items.items() if start <= k < stop}

    odd, curves, bugs = kept(rows.odd), kept(rows.curves), kept(rows.bugs)
    warned = {name: mask[start:stop] for name, mask in rows.warned.items()}
    return Rows(rows.values[start:stop], rows.met[start:stop], odd, curves, bugs, warned)


def _packed(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()


def _unpacked(text: str, dtype: Any) -> NDArray[Any]:
    return np.frombuffer(base64.b64decode(text), dtype=dtype)


def _mask(text: str, count: int) -> NDArray[np.bool_]:
    return np.unpackbits(_unpacked(text, np.uint8), count=count).astype(bool)


def _text(data: bytes) -> str:
    from zlib import compress

    return base64.b64encode(compress(data, 1)).decode()


def _bytes(text: str) -> bytes:
    from zlib import decompress

    return decompress(base64.b64decode(text))
