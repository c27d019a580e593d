"""Friction of a slider's guide, of the cam and of the slider-crank: Coulomb friction at the guide's two ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.stock.material_and_part_spec import Guide

MAX_NEWTON_STEPS = 60
"""Newton steps at most; from the force without friction some five are taken, close to jamming more."""


@dataclass(frozen=True)
class GuideFriction:
    """Friction of a guide."""

    friction: float = 0.0  # coefficient of Coulomb friction mu
    drag: float = 0.0  # what it takes without load [N]
    # distance of the line of force from the guide's middle line over half the guide's length; mu tilt < 1
    tilt: float = 0.0

    @classmethod
    def from_guide(cls, guide: Guide | None) -> Self:
        """Return the friction of a guide; that of None is nothing."""
        if guide is None:
            return cls()
        tilt = 0.0 if guide.length is None else 2.0 * guide.offset / guide.length
        return cls(guide.friction, guide.drag, tilt)

    @property
    def is_present(self) -> bool:
        """Whether anything rubs."""
        numbers: tuple[Any, ...] = (self.friction, self.drag)
        return any(bool(np.any(value) if np.ndim(value) else value) for value in numbers)

    def force(
        self,
        free: FloatArray,  # (n,): force on the slider without its guide's friction [N]
        # across, off_plane: load across the way in the plane of the mechanism, (n,), and out of that plane [N]
        across: FloatArray,
        off_plane: float,
        direction: float,  # 1 while the slider moves against the force, -1 on the way back
    ) -> FloatArray:
        """Return the force that moves the slider against the friction of its guide, (n,) [N].

        Each end carries half of what acts across the way, half of what acts out of the plane, and the couple of the
        force beside the middle line, which is itself F:
        F = free + way (drag + mu (|(across + tilt F, off)| + |(across - tilt F, off)|) / 2).
        The right side is convex in F (way = 1) or concave (-1), with a slope below 1 in size: the root is the only one,
        and Newton's steps lead to it.
        """
        numbers = (free, self.drag, self.friction, self.tilt, off_plane)
        shape = np.broadcast_shapes(*(np.shape(number) for number in numbers))
        force = still = np.broadcast_to(free + direction * self.drag, shape)
        if not np.any(self.friction):
            return force
        for _ in range(MAX_NEWTON_STEPS):
            sums, slopes = np.zeros_like(force), np.zeros_like(force)
            for sign in (1.0, -1.0):
                inside = across + sign * self.tilt * force
                end = np.hypot(inside, off_plane)
                sums += 0.5 * end
                slopes += 0.5 * sign * self.tilt * np.divide(inside, end, out=np.zeros_like(end), where=end > 0.0)
            step = (still + direction * self.friction * sums - force) / (1.0 - direction * self.friction * slopes)
            force = force + step
            if np.nanmax(np.abs(step), initial=0.0) <= 1e-15 * np.nanmax(np.abs(force), initial=0.0):
                break
        return force


FRICTIONLESS_GUIDE = GuideFriction()  # a guide that takes nothing
