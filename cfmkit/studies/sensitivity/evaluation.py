"""Evaluates the samples of a sensitivity study by the engine; every row is kept for results.csv."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.results import Status
from cfmkit.studies.engine import Work
from cfmkit.studies.parts.uncertain_values import plan_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.studies.engine import Records
    from cfmkit.studies.parts.uncertain_values import Parameter
    from cfmkit.studies.point_evaluation import Study
    from cfmkit.studies.row_blocks_for_journal import ResultRows


class Interrupted(Exception):
    """The user asked to stop: some samples are missing."""


@dataclass(frozen=True)
class Piece:
    """Points that were evaluated together."""

    records: Records  # their rows
    blocks: NDArray[np.int64]  # (n,) to which block each belongs, from 1
    roles: NDArray[np.str_]  # (n,) what each is for


@dataclass
class Evaluator:
    """Evaluates points of a study."""

    study: Study  # what is noted
    parameters: tuple[Parameter, ...]  # what varies
    compute: Callable[[Work], Records]  # from `Work` to `Records`
    by_role: bool = False  # whether all points of a role come before those of the next
    pieces: list[Piece] = field(default_factory=list)  # all that was evaluated so far
    ends: Counter[Status] = field(default_factory=Counter)  # samples by status
    first_failure: str = ""  # what the first sample without a result says

    def outputs(self, points: FloatArray, roles: Sequence[str] | Sequence[Sequence[str]]) -> FloatArray:
        """Return what comes of blocks of points: the metrics, then 0 or 1 for each requirement.

        Raises Interrupted if the user asked to stop.

        Parameters
        ----------
        points : (b, s, d) array
            Values of the parameters [SI].
        roles : sequence of str, or of one such for each block
            What the s points of a block are for.

        Returns
        -------
        (b, s, m + r) array
            NaN where there is no value; whatever is not complete has none.
        """
        count, size = points.shape[:2]
        done = sum(int(piece.blocks[-1]) for piece in self.pieces[-1:])
        order = np.arange(count * size).reshape(count, size)
        sequence = (order.T if self.by_role else order).ravel()
        flat = points.reshape(count * size, -1)[sequence]
        piece = Piece(
            self.compute(Work(self.study, plan_of(self.parameters, flat))),
            done + 1 + sequence // size,
            np.broadcast_to(np.array(roles, dtype=np.str_), (count, size)).ravel()[sequence],
        )
        self.pieces.append(piece)
        if piece.records.finished < len(piece.records):
            for _, rows in piece.records.batches():
                self._numbers_of_rows(rows)
            raise Interrupted
        outputs = np.empty((count * size, len(self.study.metrics) + len(self.study.spec.part_requirements)))
        for indices, rows in piece.records.batches():
            outputs[sequence[indices]] = self._numbers_of_rows(rows)
        return outputs.reshape(count, size, -1)

    def _numbers_of_rows(self, rows: ResultRows) -> FloatArray:
        numbers = np.concatenate([rows.values, rows.met.astype(np.float64)], axis=1)
        # A curve that ends early is measured over another travel: its metrics are no samples of these.
        failed = {k: item for k, item in rows.odd.items() if item[0] is not Status.COMPLETE}
        numbers[list(failed)] = np.nan
        self.ends[Status.COMPLETE] += len(rows) - len(rows.odd)
        self.ends.update(status for status, _ in rows.odd.values())
        if failed and not self.first_failure:
            self.first_failure = next(iter(failed.values()))[1]
        return numbers

    @property
    def count(self) -> int:
        """Samples that were evaluated."""
        return sum(self.ends.values())

    @property
    def missing(self) -> int:
        """Samples that were requested and not evaluated, since the user stopped."""
        return sum(len(piece.records) - piece.records.finished for piece in self.pieces)

    @property
    def failed(self) -> int:
        """Samples without a result."""
        return self.count - self.ends[Status.COMPLETE]
