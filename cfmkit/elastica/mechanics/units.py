"""Units in which a network is dimensionless."""

from __future__ import annotations

from typing import NamedTuple


class MechanicsUnits(NamedTuple):
    """Units of length [m], force [N] and the drive (m, rad or 1)."""

    length: float
    force: float
    drive: float

    @property
    def moment(self) -> float:
        """Unit of moment and energy [N m]."""
        return self.force * self.length
