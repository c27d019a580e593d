"""A design as its own analysis finds it: the specification that is written, and what analysis and audit say about it.

A search never judges itself: force, window and stress that are reported of a design are those of the analysis of its
specification, to the last digit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.audit import measured
from cfmkit.elastica.model.beam import fit
from cfmkit.families.base import Run
from cfmkit.families.beam.findings import percent
from cfmkit.families.beam.model import analyze
from cfmkit.families.beam.shaping.audit import Audit, audited
from cfmkit.families.beam.shaping.search import PLACES, Found
from cfmkit.families.beam.shaping.variables import Variables
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.beam.shaping.task import Task
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.results import Result


@dataclass(frozen=True)
class Judged:
    """A design with what the analysis of its specification and the audit say about it.

    Attributes
    ----------
    spec : BeamSpec
        As it is written; its window is the one that the analysis confirms.
    found : Found
        What came out of the search.
    audit : Audit
        Whether it exists as drawn.
    half_band : float or None
        The metric of this name of the analysis, over the window.
    faults : tuple of str
        What analysis and audit hold against it.
    """

    spec: BeamSpec
    found: Found
    audit: Audit
    half_band: float | None
    faults: tuple[str, ...]

    @property
    def window(self) -> tuple[float, float]:
        """The window of the design [m]."""
        window = self.spec.analysis.window
        assert window is not None
        return float(window[0]), float(window[1])


def judged(spec: BeamSpec, task: Task, found: Found) -> Judged:
    """Return a design as its own analysis finds it: the same curve, stress and metrics as of `cfmkit analyze`."""
    new = written(spec, task, found)
    result = analyze(new, Run())
    window = _confirmed_window(task, result, _window(spec, task, found), _asked(spec)[0])
    new = new.replace({"analysis.window": window})
    (band,) = measured(result, window, "half_band")
    audit = audited(Variables(task, found.order), found)
    return Judged(new, found, audit, band, tuple(_faults(task, audit, result, window)))


def _confirmed_window(task: Task, result: Result, window: tuple[float, float], asked: float) -> tuple[float, float]:
    """Return the widest window within another one over which the analysis finds the force in band; `asked` at least."""
    start, end = window

    def kept(micrometres: int) -> bool:
        (band,) = measured(result, (1e-6 * micrometres, end), "half_band")
        return band is not None and band <= task.half_band

    if task.objective != "range" or start >= asked:
        return start, end
    bad, good = round(1e6 * start), int(1e6 * asked)
    if kept(bad):
        return start, end
    while good - bad > 1:
        middle = (bad + good) // 2
        bad, good = (bad, middle) if kept(middle) else (middle, good)
    return min(good / 1e6, asked), end


def _faults(task: Task, audit: Audit, result: Result, window: tuple[float, float]) -> Iterator[str]:
    """Yield what is wrong with a design."""
    if not audit.complete:
        yield "the path ends early"
    if not audit.stable:
        yield "it is not stable all the way"
    if audit.crossings:
        yield f"beams cross at {audit.crossings} of the poses"
    (band,), (stress,) = measured(result, window, "half_band"), measured(result, (0.0, window[1]), "stress_max")
    if band is None:
        yield f"the analysis ends before the window does: {result.message}"
    elif task.objective == "range" and band > task.half_band:
        yield f"over the requested window the force is within ± {percent(band)} only"
    allowed = task.allowable_stress
    if allowed is not None and stress is not None and stress > allowed:
        yield f"the stress reaches {format_short(stress, 'stress')}, {format_short(allowed, 'stress')} are allowed"


def written(spec: BeamSpec, task: Task, found: Found) -> BeamSpec:
    """Return the specification with nodes and shapes written out, and the window of the design as its window."""
    variables = Variables(task, found.order)
    network = variables.build(found.x)
    moved = dict.fromkeys(one.node for one in task.coordinates)
    nodes = {name: (_place(network.nodes[name].x), _place(network.nodes[name].y)) for name in moved}
    changes: dict[str, Any] = {f"mechanism.nodes.{name}.at": at for name, at in nodes.items()}
    for name in task.shaped:
        beam = network.beams[name]
        start, end = network.nodes[beam.start], network.nodes[beam.end]
        reach = (
            end.x - start.x + beam.end_offset[0] - beam.start_offset[0],
            end.y - start.y + beam.end_offset[1] - beam.start_offset[1],
        )
        fitted = fit(beam, reach)
        shape = {
            "kind": "polynomial",
            "coefficients": (float(np.real(fitted.rotation)), *(float(c) for c in beam.shape.coefficients[1:])),  # type: ignore[union-attr]
            "length": float(np.real(fitted.length)),
        }
        changes[f"mechanism.beams.{name}.shape"] = shape
    changes["analysis.window"] = _window(spec, task, found)
    return spec.replace(changes)


def _window(spec: BeamSpec, task: Task, found: Found) -> tuple[float, float]:
    """Return the window of a design [m]: the one requested, or the wider one, from a whole micrometre on."""
    asked, end = _asked(spec)
    start = float(np.ceil(found.start * task.layers * 1e6 - 1e-6)) / 1e6
    return asked if abs(start - asked) < 1e-6 else start, end


def _asked(spec: BeamSpec) -> tuple[float, float]:
    """Return the window that was requested [m]."""
    assert spec.design is not None
    assert spec.design.optimise is not None
    start, end = spec.design.optimise.window
    return float(start), float(end)


def _place(value: float) -> float:
    return round(float(value), PLACES)
