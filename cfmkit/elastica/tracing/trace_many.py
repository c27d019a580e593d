"""Many networks under one drive: in this process or over several, one outcome each, failures kept as such."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.model.drive import Control
from cfmkit.elastica.results.path import PathStatus
from cfmkit.elastica.tracing.follow_alike import follow_alike
from cfmkit.elastica.tracing.trace import trace
from cfmkit.errors import CfmError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from concurrent.futures import Future

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.results.path import Path

_CHUNK_SIZE, _CHUNKS_PER_PROCESS = 256, 2  # networks set up at once; chunks for each process that are on their way


@dataclass(frozen=True)
class NetworkOutcome:
    """Status and collected value of one network."""

    # status, message: name and sentence of the path's status; ``INVALID`` and the reason where the network cannot exist
    status: str
    message: str
    value: Any  # what was collected from the path; None if there is no path


@dataclass(frozen=True)
class Requested:
    """Drive, effort and stability at the requested points that were reached."""

    drive: FloatArray
    effort: FloatArray
    stable: Any


def collect_requested(path: Path) -> Requested:
    """Return a path's values at the requested points: the default of what `trace_many` collects."""
    keep = path.at_requested
    return Requested(path.drive[keep], path.effort[keep], path.stable[keep])


def trace_many(
    networks: Iterable[Network | Callable[[], Network]],
    drive: Drive,
    control: Control | None = None,
    collect: Callable[[Path], Any] = collect_requested,
    workers: int = 1,
) -> Iterator[NetworkOutcome]:
    """Yield one outcome for each network, in their order; nothing but the collected values is kept.

    Networks of one topology are followed together where nothing happens on their way (`follow_alike`): their efforts
    have the tolerance of `trace`, not its last digits.

    Parameters
    ----------
    networks : iterable of Network, or of functions that return one
        Taken some at a time: however many there are, few are kept. Functions
        (a `functools.partial` of what builds the network, importable for several workers) are called where the network
        is traced, which leaves less to do for the process that gives out the work.
    drive : Displacement, Rotation or Loading
        What is done to each.
    control : Control, optional
        As in `trace`.
    collect : callable
        From a path to what is wanted of it; must be importable for several workers.
    workers : int
        Processes to use.
    """
    one = partial(_outcomes, drive=drive, control=control or Control(), collect=collect)
    if workers <= 1:
        for chunk in _chunks(networks):
            yield from one(chunk)
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        waiting: deque[Future[_Packed]] = deque()
        for chunk in _chunks(networks):
            waiting.append(pool.submit(_pack, chunk, one))
            if len(waiting) > _CHUNKS_PER_PROCESS * workers:
                yield from waiting.popleft().result().outcomes()
        while waiting:
            yield from waiting.popleft().result().outcomes()


def _chunks(networks: Iterable[Network | Callable[[], Network]]) -> Iterator[list[Network | Callable[[], Network]]]:
    """Yield the networks in lists of at most `_CHUNK_SIZE`."""
    source = iter(networks)
    while chunk := list(islice(source, _CHUNK_SIZE)):
        yield chunk


@dataclass(frozen=True)
class _Packed:
    """Outcomes on their way from a process: `Requested` as rows of three arrays for all, which are quicker to send."""

    said: list[tuple[str, str]]
    values: list[Any]
    arrays: tuple[FloatArray, FloatArray, Any] | None

    def outcomes(self) -> Iterator[NetworkOutcome]:
        """Yield the outcomes."""
        end = 0
        for (status, message), value in zip(self.said, self.values, strict=True):
            if self.arrays is not None and value is not None:
                begin, end = end, end + value
                value = Requested(*(array[begin:end] for array in self.arrays))
            yield NetworkOutcome(status, message, value)


def _pack(networks: list[Any], outcomes: Callable[[list[Any]], Iterator[NetworkOutcome]]) -> _Packed:
    found = list(outcomes(networks))
    said, values = [(each.status, each.message) for each in found], [each.value for each in found]
    rows = [value for value in values if value is not None]
    if not rows or not all(type(row) is Requested for row in rows):
        return _Packed(said, values, None)
    all_rows = zip(*((row.drive, row.effort, row.stable) for row in rows), strict=True)
    drive, effort, stable = (np.concatenate(same) for same in all_rows)
    lengths = [None if value is None else len(value.drive) for value in values]
    return _Packed(said, lengths, (drive, effort, stable))


def _outcomes(
    networks: list[Network | Callable[[], Network]], drive: Drive, control: Control, collect: Callable[[Path], Any]
) -> Iterator[NetworkOutcome]:
    """Yield the outcomes of some networks: of those that are followed together, or each by itself."""
    built = [_build(network) for network in networks]
    together: dict[int, FloatArray] | None = None
    for number, network in enumerate(built):
        if isinstance(network, NetworkOutcome):
            yield network
        elif together is not None and number in together:
            efforts = together[number]
            value = Requested(drive.points, efforts, np.ones(len(efforts), np.bool_))
            yield NetworkOutcome(PathStatus.COMPLETE.name, PathStatus.COMPLETE.value, value)
        else:
            try:
                path = trace(network, drive, control)
            except CfmError as error:
                yield NetworkOutcome("INVALID", str(error), None)
                continue
            if together is None and collect is collect_requested:
                together = _follow_rest(path, built, number, control)
            yield NetworkOutcome(path.status.name, path.message, collect(path))


def _build(network: Network | Callable[[], Network]) -> Network | NetworkOutcome:
    try:
        return network() if callable(network) else network
    except CfmError as error:
        return NetworkOutcome("INVALID", str(error), None)


def _follow_rest(
    path: Path, built: list[Network | NetworkOutcome], number: int, control: Control
) -> dict[int, FloatArray] | None:
    """Return the efforts of the networks behind one that was traced, by their numbers; None if they are not like it."""
    rest = {k: one for k, one in enumerate(built) if k > number and not isinstance(one, NetworkOutcome)}
    efforts = follow_alike(path, list(rest.values()), control)
    if efforts is None:
        return None
    return {k: row for k, row in zip(rest, efforts, strict=True) if np.isfinite(row).all()}
