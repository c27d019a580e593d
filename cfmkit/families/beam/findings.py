"""What a beam mechanism can suffer from, by name, and the checks that find it and put it into numbers.

The names are stable; the sentences say what the name means. The message that a run reports carries the numbers. What
the engine says is repeated with places of the drive and lengths as a user reads them: the engine knows SI numbers only.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import PathStatus, hindered_curling
from cfmkit.elastica.mechanics.discretise import discretise, without_floor
from cfmkit.elastica.mechanics.march import equations
from cfmkit.families.beam.contacts import FINDINGS as ON_CONTACTS
from cfmkit.families.beam.contacts import contact_sentences
from cfmkit.families.beam.curve_along_its_motion import window_of
from cfmkit.families.beam.largest_in_window import largest
from cfmkit.families.beam.network_from_spec import known_allowable_stresses, thickest_of, thinnest_of
from cfmkit.families.beam.scalar_results import within
from cfmkit.families.beam.taut_beams import taut_beams
from cfmkit.families.findings import finder, too_soft
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.solution import Solution
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.results import Finding


FINDINGS = {
    "closure_adjusted": "beams were turned and scaled to fit between rounded nodes, or nodes moved to the beams' ends",
    "closure_prestress": "beams are forced into place between rounded nodes: the mechanism is prestressed at rest",
    "self_contact": "the part as a solid touches itself: the curve ends there",
    "ends_early": "the path ends before the requested travel or load",
    "inaccurate": "at some points the tolerance is not reached: no force is reported there",
    "limit_point": "the load has an extremum on the path: under load control the mechanism snaps there",
    "bifurcation": "the path branches: the mechanism leaves the symmetric or straight form",
    "unstable": "a part of the path is not stable: the mechanism would leave it",
    "flutter": "under forces that rotate with their node two natural frequencies coincide: oscillations grow",
    "flutter_not_judged": "forces rotate with their node: stability is checked against divergence, not against flutter",
    "imperfection": "the beams were bent in the first buckling mode, as requested",
    "overstressed": "the stress exceeds the allowable stress within the window",
    "rescale_approximate": "the scaling law for the force is exact only for inextensible beams",
    "rescale_stress": "after scaling, the stress reaches the allowable stress within the window",
    "design_unsound": "the best shape that was found fails its audit",
    "objective_ill_posed": "the objective of the paper rewards a force that falls",
    "starts_lost": "worker processes died, and the starts that they were working on are lost",
    "search_cut_short": "the time budget ended before all starts were finished",
    "surface_out_of_reach": "following the surface requires more displacement than the solved travel",
    "surface_hole": "a part of the surface was not measured: the force there is not known, nor any extreme along it",
    "tip_lifts_off": "the mechanism no longer presses on the surface: the tip lifts off",
    "surface_stress_exceeded": "the stress along the surface exceeds the allowable one",
    "tip_jams": "somewhere the surface is too steep for the friction at the tip",
    "thick_beam": "a beam is short for its thickness: beam theory is inaccurate",
    "wide_beam": "a beam is so wide that it cannot curl across its width: it is stiffer than in beam theory",
    "beams_touch": "two beams touch, or cross: contact is not modelled",
    "joined_away_from_nodes": "the part as drawn is one piece where the mechanism has beams, pads or bars apart: they "
    "cross, touch or lie on one another, or fillets fill the gap between them",
    "pins_not_drawn": "beams turn on pins in the mechanism, but are one piece in the drawing",
    "gap_small": "two beams are closer than can be cut",
    "sharp_corners": "without fillets the stress in inside corners has no value: it grows as the mesh gets finer",
    "mesh_coarse": "the force or the largest stress of the solid is not known as closely as requested",
    "feature_small": "a beam is thinner than can be made",
    **ON_CONTACTS,
}

finding = finder(FINDINGS)
"""Return a finding of this family; the name must be one that `FINDINGS` explains."""

_NUMBER = r"(-?\d[\d.]*(?:e[+-]?\d+)?)"
_PLACE = re.compile(rf"\b(at|near) {_NUMBER}(?![\d.e]| of )")  # not a share: "lost at 0.4 of the constant loads"
_LENGTH = re.compile(rf"{_NUMBER} m\b")


def percent(share: float) -> str:
    """Return a share as a reader wants it, to three digits.

    Examples
    --------
    >>> percent(0.025512)
    '2.55 %'
    """
    return format_short(share, "ratio", 3)


def drive_text(assembly: Assembly, value: float) -> str:
    """Return a value of the drive [SI, of one copy] as the user reads it, of all copies together."""
    return assembly.spec.mechanism.drive.text(value, assembly.parallel)


def in_units(assembly: Assembly, text: str) -> str:
    """Return a sentence of the engine with units."""
    text = _LENGTH.sub(lambda found: format_short(float(found[1]), "length"), text)
    return _PLACE.sub(lambda found: f"{found[1]} {drive_text(assembly, float(found[2]))}", text)


STRETCH = "analysis.fidelity=extensible"

_PARALLEL = 1e-9  # of its length a beam may leave the line of the drive: angles are read in degrees and rounded


@dataclass(frozen=True)
class PathEnding:
    """One sentence, and what would change it, as ``--set`` takes it."""

    message: str
    cures: tuple[str, ...] = ()


def ending_of(solution: Solution) -> PathEnding:
    """Return why a path ended; a path that is complete has nothing to say."""
    path = solution.path
    said = in_units(solution.assembly, path.message or path.status.value)
    rigid = solution.spec.fidelity == "inextensible"
    taut: list[str] = []
    kept = len(solution.keep) > 1
    if rigid and path.status in (PathStatus.LIMIT_POINT, PathStatus.LOST) and len(path):
        taut = taut_beams(path, int(solution.keep[-1])) if kept else []
        # points of the curve may be so far apart that they are pulled straight after the last of them, or the first
        if not taut:
            taut, kept = taut_beams(path, len(path) - 1), False
    if not taut and len(solution.keep) < 2:
        return PathEnding(f"{said}: {_in_the_way(solution)}", (STRETCH,) if rigid else ())
    if not taut:
        return PathEnding(said)
    if kept:
        where = format_short(float(solution.motion[-1]), solution.motion_dimension)
    else:
        where = drive_text(solution.assembly, float(path.drive[-1]))
    return PathEnding(
        f"the beams are taut at {where} ({', '.join(taut)}), and inextensible beams cannot follow: allow stretching "
        "('mechanism.axial: true')",
        (STRETCH,),
    )


def _in_the_way(solution: Solution) -> str:
    """Return the keys that may keep a mechanism from having a first pose."""
    spec = solution.spec
    mechanism = spec.mechanism
    moved = [f"mechanism.nodes.{name}.moved" for name, node in mechanism.nodes.items() if node.moved is not None]
    acting = [f"mechanism.{what}" for what in ("loads", "springs") if getattr(mechanism, what)]
    keys = [*moved, *acting] or ["mechanism.drive", *(f"mechanism.nodes.{name}.support" for name in mechanism.nodes)]
    said = f"check {', '.join(keys)}"
    if spec.fidelity != "inextensible":
        return said
    along, tied = list(_along_the_drive(spec)), _over_determined(solution)
    if tied and not set(tied) <= set(along):
        reported = f"inextensible beams between places that do not move ({', '.join(tied)}) hold the network rigid"
        return f"{said}; {reported}: leave one out, or set 'mechanism.axial: true'"
    if along:
        held = f"inextensible beams lie straight along the drive ({', '.join(along)})"
        return f"{said}; {held}: let them stretch by 'mechanism.axial: true'"
    return f"{said}; beams are inextensible: 'mechanism.axial: true' lets them stretch"


def _over_determined(solution: Solution) -> list[str]:
    """Return the beams whose forces equilibrium leaves open before any load: the network is held by more than it needs.

    They are what the null vectors of the tangent have, where these move nothing.
    """
    arrays = discretise(solution.path.network, solution.path.load_case)
    arrays = without_floor(arrays, np.flatnonzero(arrays.floored))
    tangent = equations(arrays).linearise(np.zeros(len(arrays.free)), 0.0).tangent
    _, sizes, rows = np.linalg.svd(tangent)
    null = np.zeros((len(rows), arrays.size))
    null[:, arrays.free] = rows
    null = null[sizes <= _SINGULAR * sizes[0]]
    if not len(null) or np.abs(null[:, : arrays.n_motions]).max(initial=0.0) > _STILL:
        return []
    forces = np.abs(null[:, arrays.elements.unknowns[:, -2:]]).max(axis=(0, 2))
    names = [name for name, force in zip(arrays.elements.beam, forces.tolist(), strict=True) if force > _STILL]
    return list(dict.fromkeys(names))


_SINGULAR, _STILL = 1e-10, 1e-6  # of the largest singular value; motion or force of a null vector of length 1


def _along_the_drive(spec: BeamSpec) -> Iterator[str]:
    """Yield the straight beams whose ends lie one behind the other as seen along a force or a displacement."""
    mechanism = spec.mechanism
    direction = getattr(mechanism.drive, "direction", None)
    if direction is None:
        return
    for name, beam in mechanism.beams.items():
        way = np.subtract(mechanism.nodes[beam.end].at, mechanism.nodes[beam.start].at)
        across = abs(way @ (-np.sin(direction), np.cos(direction)))
        if beam.shape.kind == "straight" and across <= _PARALLEL * np.hypot(*way):
            yield name


NEGLIGIBLE = 1e-9
"""Share of a length: gaps, movements and errors of a thickness below it are rounding."""

THICK = 10.0
"""Length over thickness at which shear makes a beam between two guided ends 3 % softer, 2.6/(5/6) (t/l)^2."""


def findings_of(solution: Solution) -> tuple[Finding, ...]:
    """Return everything that is wrong with a solved mechanism, or that the user must know about it."""
    return tuple(
        one
        for source in (
            _ending, _closure, _contacts, _events, _stability, _accuracy, _imperfection, _stress, _slenderness, _width,
            _gaps,
        )
        for one in source(solution)
    )  # fmt: skip


def _ending(solution: Solution) -> Iterator[Finding]:
    path = solution.path
    if path.status not in (PathStatus.COMPLETE, PathStatus.INACCURATE, PathStatus.BLOCKED):
        why = ending_of(solution)
        yield finding("ends_early", why.message, *why.cures)


def _closure(solution: Solution) -> Iterator[Finding]:
    """Say how each beam was fitted, or what it costs to force it."""
    if moved := _moved(solution):
        yield finding("closure_adjusted", f"nodes were moved to where the beams end: {', '.join(moved)}")
        nodes = solution.spec.mechanism.nodes
        guided = [one.split(" ")[0] for one in moved if nodes[one.split(" ")[0]].support in ("guided", "roller")]
        if guided:
            yield finding("closure_adjusted", f"the guides of moved nodes were moved with them: {', '.join(guided)}")
    beams = solution.path.network.beams
    fits = {
        name: one
        for name, one in solution.path.fits.items()
        if name in solution.spec.mechanism.beams
        and getattr(beams[name].shape, "length", None)
        and one.gap > NEGLIGIBLE * float(np.real(one.length))
    }
    if not fits:
        return
    if solution.spec.mechanism.closure == "raw":
        if not len(solution.keep):
            return
        gaps = ", ".join(f"{name} by {format_short(one.gap, 'length')}" for name, one in fits.items())
        yield finding(
            "closure_prestress",
            f"beams miss their nodes ({gaps}) and are forced into place: at rest the drive carries "
            f"{format_short(float(solution.effort[0]), _effort(solution))} and the stress is "
            f"{format_short(float(solution.stress[0]), 'stress')}; closure 'rotscale' avoids both",
            "mechanism.closure=rotscale",
        )
        return
    reported = ", ".join(
        f"{name} {format_short(float(np.real(one.rotation)), 'angle')} and x {float(np.real(one.scale)):.5f} "
        f"(it missed by {format_short(one.gap, 'length')})"
        for name, one in fits.items()
    )
    yield finding("closure_adjusted", f"beams were turned and scaled to fit between their nodes: {reported}")


def _contacts(solution: Solution) -> Iterator[Finding]:
    for name, message in contact_sentences(solution, partial(drive_text, solution.assembly)):
        yield finding(name, message)


def _moved(solution: Solution) -> list[str]:
    """Return the nodes that the closure "chain" moved, each with how far."""
    if solution.spec.mechanism.closure != "chain":
        return []
    network, found = solution.path.network, []
    for name, node in solution.spec.mechanism.nodes.items():
        way = float(np.hypot(*(np.real([network.nodes[name].x, network.nodes[name].y]) - node.at)))
        if way > NEGLIGIBLE * solution.path.mesh.scales.length:
            found.append(f"{name} by {format_short(way, 'length')}")
    return found


def _effort(solution: Solution) -> str:
    return "torque" if solution.spec.mechanism.drive.turns else "force"


def _events(solution: Solution) -> Iterator[Finding]:
    path = solution.path
    for kind, name in (("limit point", "limit_point"), ("bifurcation", "bifurcation")):
        places = [drive_text(solution.assembly, event.drive) for event in path.events if event.kind == kind]
        if places:
            more = f" and {len(places) - 6} more" if len(places) > 6 else ""
            tail = _after(solution) if kind == "bifurcation" else ""
            yield finding(name, f"{kind}{'s' if len(places) > 1 else ''} at {', '.join(places[:6])}{more}{tail}")
    for what in ("prestress", "constant loads"):
        shares = [percent(event.drive) for event in path.events if event.kind == f"bifurcation under {what}"]
        if shares:
            tail = "; nothing stable was found beyond" if not path.stable[:1].all() else _after(solution)
            yield finding("bifurcation", f"bifurcation under {', '.join(shares)} of the {what}{tail}")


def _after(solution: Solution) -> str:
    """Say where the curve goes at a bifurcation."""
    if (solution.path.branch[solution.keep] == "primary").all():
        return "; the curve stays on the primary path"
    side = "analysis.other_side=" + ("false" if solution.spec.analysis.other_side else "true")
    return f"; from there the curve follows the stable branch (its mirror image: --set {side})"


def _stability(solution: Solution) -> Iterator[Finding]:
    bad = ~solution.stable_equilibrium
    if bad.any():
        x = solution.motion[bad]
        dimension = "angle" if _effort(solution) == "torque" else "length"
        yield finding(
            "unstable",
            f"{int(bad.sum())} of {len(bad)} points are not stable while the drive is held, from "
            f"{format_short(float(x.min()), dimension)} to {format_short(float(x.max()), dimension)}",
        )
    if not solution.follows or not len(solution.keep):
        return
    if solution.frequencies is None:
        yield finding(
            "flutter_not_judged",
            "forces rotate with their node: 'stable' covers divergence only; to check flutter, give every material "
            "a density",
        )
    elif solution.frequencies.flutters.any():
        first = int(solution.keep[int(solution.frequencies.flutters.argmax())])
        yield finding(
            "flutter",
            f"two natural frequencies have met at {drive_text(solution.assembly, float(solution.path.drive[first]))}: "
            "under forces that rotate with their node oscillations grow beyond",
        )


def _accuracy(solution: Solution) -> Iterator[Finding]:
    bad = int((~solution.accurate).sum())
    if bad:
        yield finding(
            "inaccurate",
            f"{bad} of {len(solution.accurate)} points miss the tolerance of {solution.spec.analysis.tolerance:g} and "
            f"have no force (estimated error {solution.path.error:.2g})",
        )


def _imperfection(solution: Solution) -> Iterator[Finding]:
    reported = in_units(solution.assembly, solution.path.imperfection)
    if reported.startswith("none: "):
        yield finding("imperfection", f"the beams were not bent: {reported.removeprefix('none: ')}")
    elif reported:
        yield finding("imperfection", f"the beams were bent by {reported}")


def _stress(solution: Solution) -> Iterator[Finding]:
    """Say where the stress in the window is too large, between points, too; of the beams whose strength is known."""
    known = known_allowable_stresses(solution.spec)
    beams = list(solution.path.network.beams)
    names = [name for name in beams if name.split(".")[0] in known]
    if not names or len(solution.keep) < 2:
        return
    allowable, axial, window = min(known.values()), solution.spec.stress == "total", window_of(solution)

    def stresses(path: Path) -> FloatArray:
        return path.beam_stresses(axial)[0][[beams.index(name) for name in names]]

    worst = largest(solution, stresses, window)
    if worst is None or worst <= allowable:
        return
    shown = solution.with_ends
    inside = np.flatnonzero(within(shown, *window))
    values = np.array([shown.stresses[name][0] for name in names])
    if not len(inside):  # the window lies between two points: the nearer one tells the place
        inside = np.array([np.abs(shown.motion - 0.5 * sum(window)).argmin()])
    best, index = np.unravel_index(int(values[:, inside].argmax()), (len(names), len(inside)))
    place = float(shown.stresses[names[best]][1][inside[index]])
    yield finding(
        "overstressed",
        f"the largest stress in the window is {format_short(worst, 'stress')}, at {place:.3f} of beam "
        f"{names[best]}; the allowable stress is {format_short(allowable, 'stress')}",
    )


def _slenderness(solution: Solution) -> Iterator[Finding]:
    beams, fits = solution.path.network.beams, solution.path.fits
    for name, beam in beams.items():
        thickest = thickest_of(beam.section)
        length = float(np.real(fits[name].length))
        if length < THICK * thickest:
            yield finding(
                "thick_beam",
                f"beam {name} is {format_short(length, 'length')} long and {format_short(thickest, 'length')} thick: "
                f"below {THICK:g} times the thickness beam theory is inaccurate",
            )


def _width(solution: Solution) -> Iterator[Finding]:
    """Say by how much beams are too soft that are solved as narrow ones."""
    if len(solution.keep) < 2 or solution.spec.mechanism.wide_beams:
        return
    found = hindered_curling(solution.path)
    share, beam = found.share[solution.keep], found.beam[solution.keep]
    worst = int(share.argmax())
    place = format_short(float(solution.motion[worst]), solution.motion_dimension)
    if reported := too_soft(float(share[worst]), f"at {place}, most of it in beam {beam[worst]}"):
        wide, narrow = "mechanism.wide_beams=true", solution.spec.analysis.modes  # frequencies are of narrow beams only
        yield finding("wide_beam", reported, (wide, "analysis.modes=0") if narrow else wide)


def _gaps(solution: Solution) -> Iterator[Finding]:
    """Say where beams touch, and what cannot be cut."""
    if len(solution.keep) < 2:
        return
    still, moving = solution.gaps
    part = solution.spec.mechanism.part
    if moving is not None and moving.size <= 0:
        when = "before any load" if still is not None and still.size <= 0 else "during the travel"
        yield finding("beams_touch", f"beams {moving.one} and {moving.other} touch {when}: contact is not modelled")
    if part is None:
        return
    least = max(part.min_gap, 2 * solution.spec.mechanism.fillet)
    if still is not None and still.size < least:
        yield finding(
            "gap_small",
            f"the gap between beams {still.one} and {still.other} is {format_short(still.size, 'length')}: smaller "
            f"than can be cut ({format_short(least, 'length')})",
        )
    made = (part.process and part.process.thinnest) or 0.0
    made = max(made, part.min_feature)
    for name, beam in solution.path.network.beams.items():
        thinnest = thinnest_of(beam.section)
        if thinnest < made * (1 - NEGLIGIBLE):
            yield finding(
                "feature_small",
                f"beam {name} is {format_short(thinnest, 'length')} thick: less than can be made "
                f"({format_short(made, 'length')})",
            )
