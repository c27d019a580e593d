"""Many cams at once: the closed form of a profile cut for no friction, run with or without.

Such a cam carries its roller along s = (x - x0)^2 / 2A, so that the state at every travel
is explicit, and whole arrays of designs are one array operation. The formulas are those
of `geometry` and `statics`, in the same order, for a cam with its own brace and
roller, without weight. An undercut cam is one of these from the end of its corner on (`undercut`).
One cut cam of any profile with other braces, rollers, springs and weights around it has a solver of its
own (`same_cam_other_parts`). Everything else (a stroke that the brace does not reach, a jam within it) is left to the
model of one cam.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.base import BlockAnswer
from cfmkit.families.cam.geometry.many_tracks_one_cam import ManyTracks
from cfmkit.families.cam.many_designs.forces import Designs, Slab
from cfmkit.families.cam.many_designs.measures import (
    BRANCHES,
    CYCLES,
    KNOWN,
    KNOWN_OF_BUILT,
    STRESSES,
    WINDOWED,
    measured,
)
from cfmkit.families.cam.many_designs.same_cam_other_parts import Around, BuiltSlab
from cfmkit.families.cam.many_designs.undercut_forces import CornerSlab, shapes
from cfmkit.families.cam.mechanism_from_spec import assemble, weights
from cfmkit.families.no_mechanism import CannotBuild
from cfmkit.metrics.spread import STATIC_BALANCE
from cfmkit.specs.units import Share

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import Block
    from cfmkit.families.cam.spec import CamSpec

SLAB = 80_000
"""Samples that are worked on together: few enough to stay in a processor's cache, 256 curves of 301 points."""

Settings = tuple[int, bool, float]

VARIED = {
    "mechanism.brace_length": "brace",
    "mechanism.rest_half_width": "x0",
    "mechanism.roller_radius": "radius",
    "mechanism.rolling_friction": "friction",
    "mechanism.springs.stiffness": "stiffness",
    "mechanism.springs.count": "count",
    "mechanism.profile.force_constant": "constant",
    "mechanism.profile.stroke": "stroke",
    "design.force": "target",
}
"""What this model can vary, and what it is called here."""


def analyze_block(spec: CamSpec, block: Block) -> BlockAnswer | None:
    """Return what is requested about many variants of a cam; None if this model does not apply.

    Parameters
    ----------
    spec : CamSpec
        What is varied.
    block : Block
        The variants and the measures.
    """
    if spec.mechanism.profile.curve is not None or spec.target_curve is not None:
        return None
    names = {measure.name for measure in block.measures}
    settings = spec.analysis.points, "contact_force_max" in names, spec.analysis.band
    if spec.gravity and STATIC_BALANCE in names:
        return None  # with weights the force is not that of the springs
    if _one_cam(spec, block) and names <= (KNOWN_OF_BUILT if spec.mechanism.contact else KNOWN):
        values = _values_around(spec, block)
        built = _designs_around(spec, values)
        return _answer(spec, block, built, _around(spec, (built, values), settings))
    if _applies(spec, block) and names <= KNOWN:
        designs = _designs(spec, block)
        return _answer(spec, block, designs, (*_plain(designs, settings), *_undercut(designs, settings)))
    return None


def _answer(
    spec: CamSpec, block: Block, designs: Designs, slabs: Iterable[tuple[NDArray[np.intp], Slab]]
) -> BlockAnswer:
    """Return what is requested, from designs that are worked on together: their places, and the designs."""
    done = np.zeros(block.size, dtype=bool)
    values = [_empty(measure.name, block.size) for measure in block.measures]
    warnings: dict[str, NDArray[np.bool_]] = {}
    limit = spec.mechanism.springs.max_elongation
    for chosen, cams in slabs:
        done[chosen] = cams.solved & _wide(spec, block, cams)
        for name, warned in cams.warned(limit):
            warnings.setdefault(name, np.zeros(block.size, dtype=bool))[chosen] = warned
        for measure, found in zip(block.measures, values, strict=True):
            for branch, numbers in measured(cams, measure).items():
                found[branch][chosen] = numbers
    return BlockAnswer(done, tuple(values), designs.target, "force", warnings)


def _wide(spec: CamSpec, block: Block, cams: Slab) -> NDArray[np.bool_]:
    """Return for which designs all windows have a width, wherever their travels end."""
    asked = {*(window for _, window in spec.windows()), *(one.window for one in block.measures if one.window)}
    wide = np.ones(len(cams.designs), dtype=bool)
    for first, last in filter(None, map(cams.ends, asked)):
        wide &= first < last
    return wide


def _plain(designs: Designs, settings: Settings) -> Iterator[tuple[NDArray[np.intp], Slab]]:
    """Yield (places, designs whose rollers run on the flank), few at a time."""
    for chosen in _slabs(np.flatnonzero(designs.sound), settings[0]):
        yield chosen, Slab(designs.take(chosen), *settings)


def _undercut(designs: Designs, settings: Settings) -> Iterator[tuple[NDArray[np.intp], Slab]]:
    """Yield (places, designs whose rollers start on a corner), few at a time."""
    for chosen in _slabs(np.flatnonzero(designs.undercut), settings[0]):
        found, which = shapes(designs.take(chosen), settings[0])
        there = [one for one in found if one is not None]
        place = np.cumsum([one is not None for one in found]) - 1
        kept = np.array([found[at] is not None for at in which.tolist()])
        if there:
            slab = CornerSlab(designs.take(chosen[kept]), *settings)
            yield chosen[kept], slab.with_shapes(there, place[which[kept]])


def _symmetric_closed(spec: CamSpec) -> bool:
    """Return whether the cam is cut for no friction and no weight, and runs so, both sides alike."""
    mechanism, profile = spec.mechanism, spec.mechanism.profile
    return (
        spec.fidelity == "quasi-static"
        and not spec.gravity
        and not (mechanism.stops or mechanism.envelope)
        and not (mechanism.pins or mechanism.bearings or mechanism.guide)
        and not (mechanism.contact or mechanism.left or mechanism.errors or profile.file)
        and not (mechanism.effective_preload or profile.preload)
        and profile.friction == 0
        and profile.slope_factor == 1
        and profile.offset == 0
        and spec.analysis.path_method == "quadrature"
        and spec.analysis.origin == "path-start"
        and spec.analysis.manufacturing is None
        and profile.stroke is not None
    )


def _applies(spec: CamSpec, block: Block) -> bool:
    mechanism = spec.mechanism
    plain = _symmetric_closed(spec) and spec.analysis.travel is None
    if not plain or not set(block.values) <= set(VARIED):
        return False
    if isinstance(mechanism.springs.each, tuple) or (spec.design is None and "design.force" in block.values):
        return False
    windows = [measure.window for measure in block.measures if measure.window and measure.name in WINDOWED]
    places = [end for window in windows for end in window if not isinstance(end, Share)]
    # Places are covered by all curves or by none only if all have the same travel.
    stroke = mechanism.profile.stroke or 0.0
    return not places or ("mechanism.profile.stroke" not in block.values and 0 <= min(places) <= max(places) <= stroke)


def _designs(spec: CamSpec, block: Block) -> Designs:
    mechanism, profile = spec.mechanism, spec.mechanism.profile
    given = {VARIED[path]: np.asarray(values, dtype=np.float64) for path, values in block.values.items()}
    base: dict[str, Any] = {
        "brace": mechanism.brace_length,
        "x0": mechanism.rest_half_width,
        "radius": mechanism.roller_radius,
        "friction": mechanism.rolling_friction,
        "stiffness": mechanism.springs.each,
        "count": mechanism.springs.count or 1,
        "constant": profile.force_constant,
        "stroke": profile.stroke,
    }
    full = {name: np.broadcast_to(np.float64(value), block.size) for name, value in base.items()} | given
    # Whole numbers above 1000 are no valid count; such a design is not sound.
    count = np.where((full["count"] >= 1) & (full["count"] <= 1000), full["count"], -1.0)
    full["strongest"], full["stiffness"] = full["stiffness"], full["stiffness"] * count
    del full["count"]
    cut_for = ((profile.brace_length, "brace"), (profile.rest_half_width, "x0"), (profile.roller_radius, "radius"))
    for fixed, name in cut_for:
        if fixed is not None:
            # Another part than the cam is cut for: the track is not the path.
            full[name] = np.where(full[name] == fixed, full[name], np.nan)
    force = 4.0 * full["stiffness"] * full["constant"]
    target = given.get("target", force if spec.design is None else np.full(block.size, spec.design.force))
    return Designs(**(full | {"target": target}))


_AROUND = {
    path: name for path, name in VARIED.items() if name in ("brace", "x0", "radius", "friction", "stiffness", "count")
} | {
    "mechanism.masses.slider": "slider",
    "mechanism.masses.brace": "brace_mass",
    "mechanism.masses.roller": "roller",
    "mechanism.contact.width": "width",
}
_SPRING = re.compile(r"mechanism\.springs\.stiffness\.(\d+)")


def _one_cam(spec: CamSpec, block: Block) -> bool:
    """Return whether all variants are built around one cam that is cut, with parts of their own."""
    mechanism, profile, analysis = spec.mechanism, spec.mechanism.profile, spec.analysis
    fixed = (profile.brace_length, profile.rest_half_width, profile.roller_radius)
    stroke = profile.stroke or analysis.travel or (spec.design.stroke if spec.design else None)
    windows = [*(ends for _, ends in spec.windows()), *(one.window for one in block.measures if one.window)]
    if any(end < 0 for ends in windows for end in ends):
        return False
    if None in (*fixed, stroke) or mechanism.left or mechanism.errors or profile.file:
        return False
    if mechanism.pins or mechanism.bearings or mechanism.guide or (spec.gravity and mechanism.mounting):
        return False
    if profile.preload is None and mechanism.preload:  # the cam follows what its springs have at the start
        return False
    if mechanism.springs.initial_tension:  # how much elongation that is depends on the stiffness
        return False
    if spec.fidelity != "quasi-static" or analysis.manufacturing or analysis.path_method != "quadrature":
        return False
    listed = isinstance(mechanism.springs.each, tuple)
    if analysis.origin != "path-start" or (listed and "mechanism.springs.count" in block.values):
        return False
    for path in block.values:
        if not (_SPRING.fullmatch(path) if listed and "stiffness" in path else path in _AROUND):
            return False
        if path.startswith("mechanism.masses.") and mechanism.masses is None:
            return False
        if path == "mechanism.contact.width" and mechanism.contact is None:
            return False
    return True


def _values_around(spec: CamSpec, block: Block) -> dict[str, FloatArray]:
    """Return the parts around a cam, each of all variants: NaN where a value is none that a specification may have."""
    mechanism, masses = spec.mechanism, spec.mechanism.masses
    values: dict[str, Any] = {
        "brace": mechanism.brace_length,
        "x0": mechanism.rest_half_width,
        "radius": mechanism.roller_radius,
        "friction": mechanism.rolling_friction,
        "slider": masses.slider if masses else 0.0,
        "brace_mass": masses.brace if masses else 0.0,
        "roller": masses.roller if masses else 0.0,
        "width": mechanism.contact.width if mechanism.contact else 1.0,
        "count": 1 if isinstance(mechanism.springs.each, tuple) else mechanism.springs.count or 1,
    }
    given = {_AROUND[path]: np.asarray(found, float) for path, found in block.values.items() if path in _AROUND}
    full = {name: np.broadcast_to(np.float64(value), block.size) for name, value in values.items()} | given
    springs = mechanism.springs.each
    total, strongest = np.zeros(block.size), np.zeros(block.size)
    for index, stated in enumerate(springs if isinstance(springs, tuple) else (springs,)):
        one = block.values.get(f"mechanism.springs.stiffness.{index}", given.get("stiffness", stated))
        total = total + np.where(np.asarray(one, float) > 0, one, np.nan)
        strongest = np.maximum(strongest, np.asarray(one, float))
    full["strongest"], count = strongest, full.pop("count")
    full["stiffness"] = total * np.where((count >= 1) & (count <= 1000) & (count == np.rint(count)), count, np.nan)
    return full


def _designs_around(spec: CamSpec, values: dict[str, FloatArray]) -> Designs:
    """Return the parts around a cam; `x0` is where their springs are at rest."""
    profile, size = spec.mechanism.profile, len(values["brace"])
    names = ("brace", "x0", "radius", "friction", "stiffness", "strongest")
    values = values | {"x0": _at_rest(spec, values["x0"])}
    constant = np.full(size, profile.force_constant)
    if spec.design is not None:
        target = np.full(size, spec.design.force)
    else:
        target = 4.0 * values["stiffness"] * constant + _weights(spec, values)[1]
    own = {name: values[name] for name in names}
    return Designs(**own, constant=constant, stroke=np.full(size, np.nan), target=target)


def _at_rest(spec: CamSpec, half_width: FloatArray) -> FloatArray:
    """Return half the distances of the roller axes at which springs are at rest; NaN where that cannot be [m]."""
    springs = spec.mechanism.springs
    if springs.rest_length is not None:
        return np.where(springs.rest_length <= 2.0 * half_width, 0.5 * springs.rest_length, np.nan)
    return half_width - 0.5 * (springs.preload or 0.0)


def _weights(spec: CamSpec, values: dict[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the weights that hang on one roller and on the slider [N]."""
    if not spec.gravity:
        return np.zeros_like(values["brace"]), np.zeros_like(values["brace"])
    return weights(values["slider"], values["brace_mass"], values["roller"])


def _around(
    spec: CamSpec,
    built: tuple[Designs, dict[str, FloatArray]],
    settings: Settings,
) -> Iterator[tuple[NDArray[np.intp], Slab]]:
    """Yield (places, mechanisms around the specification's cam), few at a time; none if there is no such cam."""
    designs, values = built
    try:
        cam = assemble(spec)
    except CannotBuild:
        return
    law, asked = cam.profile.path.law, spec.analysis.travel
    windows = [window for _, window in spec.windows()]
    masses = np.minimum.reduce([values["slider"], values["brace_mass"], values["roller"]])
    shortest = np.minimum(designs.brace, law.brace_length)
    sound = (designs.radius > 0) & (designs.brace > 0) & (designs.x0 > 0) & (designs.stiffness > 0)
    sound &= (designs.friction >= 0) & (designs.friction < 1) & (masses >= 0) & (values["width"] > 0)
    sound &= (law.rest_half_width < shortest * (1 - 1e-6)) & (designs.radius < designs.brace)
    if cam.shortfall is not None:
        return
    rows = np.flatnonzero(sound)
    pairs = np.stack([designs.radius[rows], designs.brace[rows]], axis=1)
    unique, which = np.unique(pairs, axis=0, return_inverse=True)
    left = max(spec.mechanism.profile.offset, 0.0)
    tracks = ManyTracks(cam.track.profile, unique[:, 0] + left, unique[:, 1])
    parts = (*_weights(spec, values), values["radius"], values["width"])
    around = Around(cam, tracks, which.reshape(-1), asked, *(each[rows] for each in parts))
    # A cam without a corner, or one that some rollers pass over, has fewer places to look at.
    corner = (tracks.corner_end > tracks.start)[around.which, 0]
    usable = tracks.fits[around.which]
    for alike in (usable & corner, usable & ~corner):
        for chosen in _slabs(np.flatnonzero(alike), settings[0]):
            slab = BuiltSlab(designs.take(rows[chosen]), *settings)
            yield rows[chosen], slab.built(around.take(chosen), windows)


def _slabs(chosen: NDArray[np.intp], points: int) -> list[NDArray[np.intp]]:
    size = max(1, SLAB // points)
    return [chosen[start : start + size] for start in range(0, len(chosen), size)]


def _empty(name: str, size: int) -> dict[str, FloatArray]:
    branches = BRANCHES if name in (*WINDOWED, *STRESSES) and name not in CYCLES else ("",)
    return {branch: np.full(size, np.nan) for branch in branches}
