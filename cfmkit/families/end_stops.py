"""End stops of a driven shuttle or slider: their force on the drive, their columns, scalar results and findings.

What is driven moves as it is driven. So a stop changes nothing but the force that this takes: beyond its gap an elastic
one adds stiffness times the way beyond, at a rigid one the drive is blocked and the curve ends. A part that rests on a
stop before it is driven begins there, with the force that presses it on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cfmkit.curves import Column
from cfmkit.families.findings import mm, newton
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.end_stops_spec import EndStop

SAME_PLACE = 1e-12  # motions that differ by less are one [m]
CONTACT_QUANTITIES = {
    "first_contact": ("length", "displacement of the driven node at which the first contact begins"),
    "contact_force[contact]": (
        "force", "mean force in the window of the stop or the obstacle that is named, on one copy; of a stop with two "
        "sides positive where it limits the motion along its direction, of an obstacle the sum of all pads"
    ),
    "contact_force_ripple[contact]": ("ratio", "(max - min)/max of that force in the window"),
}  # fmt: skip
"""Scalar results on contacts, of all families."""
LARGEST_FORCE = (
    "largest normal force: of a stop or an obstacle on one copy, or between tip and `analysis.surface` in both "
    "directions of the motion"
)
STOP_QUANTITIES = CONTACT_QUANTITIES | {
    "contact_force_max": ("force", LARGEST_FORCE)
}  # those of a family with end stops
STOP_FINDINGS = {
    "contact_begins": "a stop is reached, or a pad touches an obstacle",
    "blocked": "a rigid contact leaves the drive no way to go on: the curve ends there",
}


class StopEvent(NamedTuple):
    """A stop that is reached, left, or blocks the drive."""

    name: str
    kind: str  # begins, ends, blocks
    place: float  # [m]


@dataclass(frozen=True)
class EndStops:
    """All stops of a part on one line of motion; none: `NO_STOPS`."""

    stops: tuple[tuple[str, EndStop], ...] = ()

    def __bool__(self) -> bool:
        """Return whether there is any."""
        return bool(self.stops)

    @property
    def rigid_ends(self) -> tuple[float, float]:
        """Motions between which rigid stops leave the part [m]."""
        ends = [stop.ends for _, stop in self.stops if stop.stiffness is None]
        return max((low for low, _ in ends), default=-math.inf), min((high for _, high in ends), default=math.inf)

    @property
    def free_end(self) -> float:
        """First motion along the drive at which a stop is reached [m]; infinite without one."""
        return min((stop.ends[1] for _, stop in self.stops), default=math.inf)

    @property
    def marks(self) -> FloatArray:
        """Motions at which a stop is reached, increasing [m]."""
        ends = {end for _, stop in self.stops for end in stop.ends if math.isfinite(end)}
        return np.array(sorted(ends))

    def elastic_force(self, name: str, motion: FloatArray) -> FloatArray:
        """Return the force of one elastic stop at motions [N], positive where it limits the motion along the drive."""
        stop = dict(self.stops)[name]
        low, high = stop.ends
        beyond = np.maximum(motion - high, 0.0) - np.maximum(low - motion, 0.0)
        return np.zeros(np.shape(motion)) if stop.stiffness is None else np.asarray(stop.stiffness * beyond)

    def force(self, motion: FloatArray) -> FloatArray:
        """Return what all elastic stops add to the force of the drive at motions [N]."""
        return np.asarray(sum((self.elastic_force(name, motion) for name, _ in self.stops), np.zeros(np.shape(motion))))

    def blocking(self, end: float) -> str | None:
        """Return the rigid stop at which a motion ends; None if another reason ends it."""
        for name, stop in self.stops:
            if stop.stiffness is None and abs(stop.ends[1] - end) <= SAME_PLACE + 1e-12 * abs(end):
                return name
        return None

    def events(self, motion: FloatArray, pressed: bool = True) -> list[StopEvent]:
        """Return what happens on a curve over increasing motions (n,).

        `pressed`: whether it begins with a force, which a rigid stop bears before the drive does.
        """
        start, end, events = float(motion[0]), float(motion[-1]), list[StopEvent]()
        for name, stop in self.stops:
            low, high = stop.ends
            rigid = stop.stiffness is None
            at_rest = rigid and pressed and abs(start - low) <= SAME_PLACE
            if math.isfinite(low) and (start < low - SAME_PLACE or at_rest):
                events.append(StopEvent(name, "ends", max(start, low)))
            if rigid and self.blocking(end) == name:
                events.append(StopEvent(name, "blocks", high))
            elif start <= high < end:
                events.append(StopEvent(name, "begins", high))
        return sorted(events, key=lambda event: event.place)

    def columns(self, motion: FloatArray, pressed: bool) -> dict[str, Column]:
        """Return the force of each stop at the points of a curve, and what happens there."""
        if not self.stops:
            return {}
        columns = {f"stop_{name}_force": Column(self.elastic_force(name, motion), "force") for name, _ in self.stops}
        marks = np.full(len(motion), "", dtype=object)
        for event in self.events(motion, pressed):
            point = int(np.abs(motion - event.place).argmin())
            marks[point] = f"{marks[point]}; {event.name} {event.kind}".removeprefix("; ")
        return columns | {"event": Column(np.array([str(mark) for mark in marks], np.str_), "text")}

    def values(self, motion: FloatArray, pressed: bool, window: tuple[float, float]) -> dict[str, Quantity]:
        """Return the scalar results on stops of a curve over motions (n,), in a window [m]."""
        if not self.stops:
            return {}
        start, end = float(motion[0]), float(motion[-1])
        reached = [event.place if event.kind != "ends" else start for event in self.events(motion, pressed)]
        quantities = {"first_contact": Quantity(min(reached, default=None), *CONTACT_QUANTITIES["first_contact"])}
        low, high = max(window[0], start), min(window[1], end)
        covers = high > low and high - low >= (1 - 1e-9) * (window[1] - window[0])
        reason = "" if covers else "the window is not on the curve"
        inside = np.array([low, *(mark for mark in self.marks.tolist() if low < mark < high), high])
        tops = list[float]()
        for name, _ in self.stops:
            force = self.elastic_force(name, inside)
            mean = float(np.trapezoid(force, inside) / (high - low)) if covers else None
            ripple = float(np.ptp(force) / force.max()) if covers and force.max() > 0 else None
            untouched = "" if ripple is not None else reason or "there is no contact in the window"
            tops.append(float(np.abs(force).max()))
            quantities |= {
                f"contact_force[{name}]": Quantity(mean, *CONTACT_QUANTITIES["contact_force[contact]"], reason=reason),
                f"contact_force_ripple[{name}]": Quantity(
                    ripple, *CONTACT_QUANTITIES["contact_force_ripple[contact]"], reason=untouched
                ),
            }
        return quantities | {"contact_force_max": Quantity(max(tops) if covers else None, "force", LARGEST_FORCE)}

    def sentences(self, motion: FloatArray, first: float) -> Iterator[tuple[str, str]]:
        """Yield name and message of each finding on a curve over motions that begins with a force [N], or zero."""
        reported = list[str]()
        for event in self.events(motion, first > 0):
            if event.kind == "blocks":
                continue
            if event.kind == "ends":
                force = newton(abs(float(self.elastic_force(event.name, motion[:1])[0])) or first)
                reported.append(f"at rest stop {event.name!r} is pressed by {force}, and left at {mm(event.place)}")
                continue
            force = newton(float(self.elastic_force(event.name, motion[-1:])[0]))
            reported.append(f"stop {event.name!r} is reached at {mm(event.place)}; its force at the end is {force}")
        if reported:
            yield "contact_begins", "; ".join(reported)
        if text := self.describe_block(float(motion[-1])):
            yield "blocked", text

    def describe_block(self, end: float) -> str:
        """Return that a motion ends at a rigid stop, and at which; empty if it does not."""
        name = self.blocking(end)
        return "" if name is None else f"the drive is blocked by stop {name!r} at {mm(end)}"

    def mark_rows(self, rows: Iterable[FloatArray]) -> list[FloatArray]:
        """Return increasing motions of curves (n,) up to rigid stops, with those at which a stop is reached [m]."""
        low, high = self.rigid_ends
        rows_between = []
        for row in rows:
            kept = row[(row >= low) & (row <= high)]
            marks = self.marks[(self.marks > row[0]) & (self.marks <= min(row[-1], high))]
            every = np.union1d(kept, marks)
            rows_between.append(every[np.append(True, np.diff(every) > SAME_PLACE)] if len(every) else every)
        return rows_between


NO_STOPS = EndStops()
