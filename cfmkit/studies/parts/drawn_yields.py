"""The yield of a design by drawn parts: before and after the design, and what better workshops would make of it.

Errors that scale the force of a whole part, as that of the modulus does, are no matter of its shape. The yield is
therefore stated a second time without those, and a third time after a trim that brings the mean force of each part to
that of the design. Which errors those are is not guessed from their names: each is moved by its standard deviation, and
common is what changes the force by the same share everywhere in the window.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import CfmError, SpecError
from cfmkit.families import family
from cfmkit.metrics import window_of
from cfmkit.results import Quantity
from cfmkit.specs.spec import DesignKeys
from cfmkit.specs.what_yield_metrics_mean import OF_MANY_PARTS
from cfmkit.studies.parts.outcomes import analyze_parts
from cfmkit.studies.parts.parts import NO_TOLERANCE, Parts
from cfmkit.studies.parts.share import percent

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.results import Result
    from cfmkit.specs.spec import DesignBlock, Spec
    from cfmkit.studies.parts.share import Share

COMMON_SPREAD = 0.1
"""An error is common if its relative change of force varies along the motion by at most this share of itself."""
LEAST_FORCE = 0.05  # where the force is below this share of its largest value, a share of it says nothing


@dataclass(frozen=True)
class Yields:
    """Yields of a design, of those that were drawn."""

    parts: Parts  # of the design
    after: Share  # parts as they are
    trimmed: Share  # the same parts after a trim
    frozen: Share | None  # without common errors; None if there are none
    common: tuple[str, ...]  # the paths of those
    each: tuple[Share, ...]  # of parts that meet one requirement
    before: Share | None  # of the specification that the design began with
    why: str = ""  # why there is none of that
    # how many of the parts have a curve, but no value for a requirement, and why the first has none
    lacking: tuple[int, str] = (0, "")

    def quantities(self) -> dict[str, Quantity]:
        """Return the metrics of many parts."""
        low, high = self.after.clopper_pearson
        numbers = {
            "yield": self.after.value,
            "yield_low": low,
            "yield_high": high,
            "yield_before": self.before.value if self.before else None,
            "yield_with_common_frozen": (self.frozen or self.after).value,
            "yield_after_trim": self.trimmed.value,
        }
        reasons = {"yield_before": self.why}
        return {
            name: Quantity(numbers[name], "ratio", about, reasons.get(name, ""))
            for name, about in OF_MANY_PARTS.items()
        }

    def as_json(self) -> dict[str, Any]:
        """Return the block `yield` of metrics.json."""
        requirements = self.parts.spec.part_requirements
        each = [{"metric": one.metric} | share.as_json() for one, share in zip(requirements, self.each, strict=True)]
        return self.after.as_json() | {
            "seed": self.parts.seed,
            "before": self.before.as_json() if self.before else None,
            "with_common_frozen": (self.frozen or self.after).as_json(),
            "after_trim": self.trimmed.as_json(),
            "common": list(self.common),
            "requirements": each,
        }

    def sentence(self) -> str:
        """Return the yield in a sentence, and what would raise it."""
        low, high = self.after.clopper_pearson
        reported = f"{percent(self.after.value)} of {self.after.count} parts drawn from design.tolerances are good "
        reported += f"({percent(low)} to {percent(high)} with 95 % confidence)"
        if self.before is not None:
            reported += f"; {percent(self.before.value)} of the specification as given"
        if self.after.failed:
            reported += f"; {self.after.failed} have no complete result and count as bad (the first: {self.after.why})"
        count, reason = self.lacking
        if count:
            first = f" (the first: {reason})" if reason else ""
            reported += f"; {count} have no value for a requirement and count as bad{first}"
        if self.frozen is not None:
            without = f"without the errors of the whole part ({', '.join(self.common)})"
            reported += f"; {percent(self.frozen.value)} {without}"
        reported += f"; {percent(self.trimmed.value)} after a trim of the force"
        worst = min(range(len(self.each)), key=lambda k: self.each[k].value)
        if self.each[worst].value < 1.0:
            metric = self.parts.spec.part_requirements[worst].metric
            reported += f"; most are lost by {metric}, which {percent(1.0 - self.each[worst].value)} miss"
        return reported


def yields_of(design: Result, given: Spec | None, run: Run) -> Yields | None:
    """Return the yield of an analysed design and of the specification that it began with; None without tolerances.

    Raises SpecError if a tolerance is on a value that the design does not have.
    """
    block: DesignKeys | None = getattr(design.spec, "design", None) or getattr(given, "design", None)
    if not isinstance(block, DesignKeys) or (parts := Parts.from_design(design.spec, block, run.seed)) is None:
        return None
    values = parts.draw()
    found = analyze_parts(parts, values, design, run.part(0.0, 0.4))
    shared, frozen = common_errors(parts, design, run), None
    if shared:
        still = parts.remove_errors(values, shared)
        frozen = analyze_parts(parts, still, design, run.part(0.4, 0.7), "parts without common errors").share()
    is_same = given == design.spec  # a design that is designed again: its parts are known
    before, why = (found.share(), "") if is_same else _yield_before(given, block, run.part(0.7, 1.0))
    each = tuple(found.share(found.met[:, [k]]) for k in range(found.met.shape[1]))
    paths = tuple(parts.paths[k] for k in shared)
    return Yields(parts, found.share(), found.share(found.trimmed), frozen, paths, each, before, why, found.lacking)


def no_yields(given: Spec) -> dict[str, Quantity]:
    """Return the metrics of many parts that requirements are on, without values: no tolerance is known."""
    asked = dict.fromkeys(one.metric for one in given.requirements if one.metric in OF_MANY_PARTS)
    return {name: Quantity(None, "ratio", OF_MANY_PARTS[name], NO_TOLERANCE) for name in asked}


def _yield_before(given: Spec | None, block: DesignBlock, run: Run) -> tuple[Share | None, str]:
    """Return the yield of the specification as given, or why there is none."""
    if given is None:
        return None, "nothing was given to begin with"
    try:
        parts = Parts.from_design(given, block, run.seed)
        result = family(given.family).analyze(given, run)
        if parts is None or not result.curves:
            return None, f"the specification as given has no curve: {result.message}"
        return analyze_parts(parts, parts.draw(), result, run, "parts as given").share(), ""
    except SpecError as error:
        return None, "; ".join(f"{one.path}: {one.message}" for one in error.problems)
    except CfmError as error:
        return None, str(error)


def common_errors(parts: Parts, nominal: Result, run: Run) -> tuple[int, ...]:
    """Return the parameters whose errors change the force by the same share everywhere in the window."""
    found: list[int] = []
    for members in parts.joined:
        share = _force_change(parts, members, nominal, run)
        if share is not None and np.ptp(share) <= COMMON_SPREAD * abs(share.mean()) and abs(share.mean()) > 0:
            found += members
    return tuple(sorted(found))


def _force_change(parts: Parts, members: tuple[int, ...], nominal: Result, run: Run) -> FloatArray | None:
    """Return by which share a standard deviation of some parameters changes the force; None if it cannot be said."""
    changes = {parts.paths[k]: float(parts.nominal[k] + parts.deviations[k]) for k in members}
    try:
        moved = family(parts.spec.family).analyze(parts.spec.replace(changes), run)
    except CfmError:
        return None
    if not moved.curves:
        return None
    before, after = nominal.curve, moved.curve
    same = before.motion.shape == after.motion.shape and np.allclose(before.motion, after.motion, rtol=1e-9, atol=1e-12)
    if not same:
        return None
    window = window_of(nominal)
    low, high = (window.lo, window.hi) if window else (float(before.motion.min()), float(before.motion.max()))
    with np.errstate(invalid="ignore"):
        large = np.abs(before.effort) > LEAST_FORCE * np.nanmax(np.abs(before.effort))
        inside = (before.motion >= low) & (before.motion <= high) & large & np.isfinite(after.effort)
    return np.asarray(after.effort[inside] / before.effort[inside] - 1.0) if inside.sum() > 1 else None
