"""Blocks of consecutive rows of a study: joined, cut, selected, and packed for the journal and read back."""

from __future__ import annotations

import base64
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from zlib import compress, decompress

import numpy as np

from cfmkit.results import Status

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray


WARNINGS_JOINT = "; "  # between the names of warnings in a column of a table
_STATUS_BY_KEY = {status.key: status for status in Status}


@dataclass(frozen=True)
class ResultRows:
    """Consecutive rows of a study."""

    values: FloatArray  # (n, m) metrics [SI]; NaN where there is no value
    met: NDArray[np.bool_]  # (n, r) requirements; False where nothing was solved
    # status and message of the rows that are not complete, or that have something to say
    odd: Mapping[int, tuple[Status, str]] = field(default_factory=dict)
    curves: Mapping[int, bytes] = field(default_factory=dict)  # curves as CSV, where they are kept
    bugs: Mapping[int, str] = field(default_factory=dict)  # tracebacks
    warned: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)  # name of a warning -> the rows that have it

    def __len__(self) -> int:
        return len(self.values)

    @property
    def failed(self) -> int:
        """Number of rows that are not complete."""
        return sum(status is not Status.COMPLETE for status, _ in self.odd.values())

    @property
    def keepable(self) -> bool:
        """Whether every row is what it would be on any machine: none timed out, crashed or hit a bug."""
        return not any(status in (Status.TIMEOUT, Status.CRASHED) for status, _ in self.odd.values())

    def status(self, index: int) -> tuple[Status, str]:
        """Return status and message of one row."""
        return self.odd.get(index, (Status.COMPLETE, ""))


def failed_rows(
    shape: tuple[int, int, int],  # rows, metrics and requirements
    status: Status,
    message: str,
    bug: str = "",
    warned: Mapping[str, NDArray[np.bool_]] | None = None,
) -> ResultRows:
    """Return rows without values, all for one reason."""
    rows = range(shape[0])
    values, met = np.full(shape[:2], np.nan), np.zeros((shape[0], shape[2]), dtype=bool)
    odd, bugs = dict.fromkeys(rows, (status, message)), dict.fromkeys(rows, bug) if bug else {}
    return ResultRows(values, met, odd, bugs=bugs, warned=warned or {})


def record(rows: ResultRows) -> Any:
    """Return rows as the journal keeps them: numbers packed, which takes a tenth of the time of their decimals.

    Many rows together take a tenth of the room: what one has in common with the one before is left out.
    """
    odd = {str(k): [status.key, message] for k, (status, message) in rows.odd.items()}
    reported = {"n": len(rows), "v": squeeze(rows.values), "q": _pack(np.packbits(rows.met)), "o": odd}
    if rows.warned:
        reported["w"] = {name: _pack(np.packbits(mask)) for name, mask in sorted(rows.warned.items())}
    return reported | (
        {"u": {str(k): _compress_to_text(curve) for k, curve in rows.curves.items()}} if rows.curves else {}
    )


def recall_rows(reported: Any, metrics: int, requirements: int) -> ResultRows:
    """Return the rows that are stored in a record."""
    count = reported["n"]
    values = unsqueeze(reported["v"], count, metrics)
    met = _unpack_mask(reported["q"], count * requirements).reshape(count, requirements)
    curves = {int(k): _decompress_text(text) for k, text in reported.get("u", {}).items()}
    odd = {int(k): (_STATUS_BY_KEY[s], m) for k, (s, m) in reported["o"].items()}
    warned = {name: _unpack_mask(bits, count) for name, bits in reported.get("w", {}).items()}
    return ResultRows(values, met, odd, curves, warned=warned)


def join_rows(parts: Sequence[ResultRows]) -> ResultRows:
    """Return several pieces as one."""
    if len(parts) == 1:
        return parts[0]
    offsets = np.cumsum([0, *map(len, parts)]).tolist()
    pairs = list(zip(offsets, parts, strict=False))
    return ResultRows(
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.met for part in parts]),
        {start + k: item for start, part in pairs for k, item in part.odd.items()},
        {start + k: item for start, part in pairs for k, item in part.curves.items()},
        {start + k: item for start, part in pairs for k, item in part.bugs.items()},
        _joined_masks(parts),
    )


def _joined_masks(parts: Sequence[ResultRows]) -> dict[str, NDArray[np.bool_]]:
    """Return the masks of all warnings over all pieces."""
    names = sorted({name for part in parts for name in part.warned})
    return {
        name: np.concatenate([part.warned.get(name, np.zeros(len(part), dtype=bool)) for part in parts])
        for name in names
    }


def scatter_rows(count: int, parts: Sequence[tuple[NDArray[np.intp], ResultRows]]) -> ResultRows:
    """Return rows in order of pieces that are some of them each: (which they are, the piece)."""
    order = np.concatenate([members for members, _ in parts])
    assert len(order) == count
    return select_rows(join_rows([part for _, part in parts]), np.argsort(order))


def select_rows(rows: ResultRows, chosen: NDArray[np.intp]) -> ResultRows:
    """Return some of the rows, in the order in which they are chosen."""
    if np.array_equal(chosen, np.arange(len(rows))):
        return rows

    def pick(items: Mapping[int, Any]) -> dict[int, Any]:
        return {place: items[k] for place, k in enumerate(chosen.tolist()) if k in items} if items else {}

    warned = {name: mask[chosen] for name, mask in rows.warned.items() if mask[chosen].any()}
    odd, curves, bugs = pick(rows.odd), pick(rows.curves), pick(rows.bugs)
    return ResultRows(rows.values[chosen], rows.met[chosen], odd, curves, bugs, warned)


def cut_rows(rows: ResultRows, start: int, stop: int) -> ResultRows:
    """Return the rows from one up to another."""
    return select_rows(rows, np.arange(start, stop))


def _pack(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()


def _unpack(text: str, dtype: Any) -> NDArray[Any]:
    return np.frombuffer(base64.b64decode(text), dtype=dtype)


N_DIFFERENCE_ORDERS = 4  # each column is kept as its differences of order 0, 1, 2 or 3, whichever takes the fewest bits
_N_PROBED_ROWS = 512  # rows from which the order is chosen


def squeeze(values: FloatArray) -> str:
    """Return the bits of a table of numbers, (n, m), in few characters.

    Neighbours in a grid are alike: the bit patterns of a column, as whole numbers, are nearly a polynomial, and
    high-order bytes of their differences are zero. Whole numbers wrap around, so that nothing is lost,
    infinities and NaN included. Of a thousand by a thousand points one number in eight bytes takes half a byte.
    """
    bits = np.ascontiguousarray(np.asarray(values, dtype="<f8").T).view("<u8")
    tried = [bits]
    while len(tried) < N_DIFFERENCE_ORDERS:
        tried.append(np.diff(tried[-1], axis=1, prepend=np.uint64(0)))
    folded = [_fold_sign(column) for column in tried]
    middle = slice(bits.shape[1] // 2, bits.shape[1] // 2 + _N_PROBED_ROWS)
    lengths = [np.log2(column[:, middle].astype(np.float64) + 1.0).sum(axis=1) for column in folded]
    order = np.argmin(lengths, axis=0).astype(np.uint8)
    chosen = np.choose(order[:, None], folded)
    planes = chosen.view(np.uint8).reshape(*chosen.shape, 8).transpose(0, 2, 1)
    return base64.b64encode(order.tobytes() + compress(planes.tobytes())).decode()


def unsqueeze(text: str, rows: int, columns: int) -> FloatArray:
    """Return the table that `squeeze` made a text of."""
    data = base64.b64decode(text)
    order = np.frombuffer(data[:columns], dtype=np.uint8)
    planes = np.frombuffer(decompress(data[columns:]), dtype=np.uint8).reshape(columns, 8, rows)
    folded = np.ascontiguousarray(planes.transpose(0, 2, 1)).reshape(columns, 8 * rows).view("<u8")
    bits = (folded >> np.uint64(1)) ^ (~(folded & np.uint64(1)) + np.uint64(1))
    for least in range(1, N_DIFFERENCE_ORDERS):
        chosen = order >= least
        bits[chosen] = np.cumsum(bits[chosen], axis=1, dtype=np.uint64)
    values: FloatArray = np.ascontiguousarray(bits.view("<f8").T).astype(np.float64, copy=False)
    return values


def _fold_sign(bits: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return whole numbers with the sign in the last bit: small negative ones have zeros in front, too."""
    signed = bits.view(np.int64)
    return ((signed << 1) ^ (signed >> 63)).view(np.uint64)


def _unpack_mask(text: str, count: int) -> NDArray[np.bool_]:
    return np.unpackbits(_unpack(text, np.uint8), count=count).astype(bool)


def _compress_to_text(data: bytes) -> str:
    return base64.b64encode(compress(data, 1)).decode()


def _decompress_text(text: str) -> bytes:
    return decompress(base64.b64decode(text))
