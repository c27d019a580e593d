"""From a specification to the chain that is pressed: lumped flexures or a strip, on the linkage's joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import InputError
from cfmkit.families.slider_crank.linkage import linkage_of, unloaded_linkage
from cfmkit.families.slider_crank.printed.equilibrium_path import Chain
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import (
    STRIP_BEAM,
    Elasticity,
    Flexure,
    Strip,
    flexure_ends,
    flexure_network,
    joints,
    kink,
    stations,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Path
    from cfmkit.families.slider_crank.linkage import Linkage
    from cfmkit.families.slider_crank.printed.spec import Printed, StripSpec
    from cfmkit.families.slider_crank.spec import Mechanism, SliderCrankSpec


FLEXURE_SHARE = 0.2  # length of a flexure where none is given, in crank lengths: that of [B, Table 2]


def elasticity(printed: Printed) -> Elasticity:
    """Return what the part is made of.

    Raises InputError if no material is given.
    """
    material = printed.material
    if material is None:
        raise InputError("a part of flexures or a strip needs 'mechanism.material'")
    return Elasticity(material.modulus, material.poisson, material.allowable(printed.safety_factor), printed.wide_beams)


def flexures_of(printed: Printed) -> tuple[Flexure, ...]:
    """Return the flexures from the ground to the slider."""
    if printed.flexures is None:
        return ()
    return tuple(
        Flexure(flexure.length, flexure.thickness, flexure.width, flexure.before) for flexure in printed.flexures.all
    )


def corners(mechanism: Mechanism, beam: StripSpec | None) -> FloatArray:
    """Return the centre line of a strip, or of flexures (None): through the ends of the flexures unless given [m].

    Raises InputError if these are longer than the links between them.
    """
    if beam is not None and beam.centreline is not None:
        return np.array(beam.centreline)
    linkage, unloaded = unloaded_linkage(mechanism)
    flexures, length = flexures_of(mechanism), FLEXURE_SHARE * linkage.crank
    if beam is not None and beam.flexure_length is not None:
        flexures, length = (), beam.flexure_length
    lengths = [flexure.length for flexure in flexures] or [length] * 3
    before = [flexure.before for flexure in flexures] or [0.5] * 3
    return flexure_ends(joints(linkage, unloaded), lengths, before)


def strip_of(mechanism: Mechanism) -> Strip:
    """Return the strip as it is printed.

    Raises InputError if 'shares' does not fit the pieces of the centre line.
    """
    beam = mechanism.beam
    if beam is None:
        raise InputError("there is no 'mechanism.beam'")
    line = corners(mechanism, beam)
    if beam.shares is None:
        places = np.linspace(0.0, 1.0, len(beam.values))
    elif len(beam.shares) != len(line) - 1:
        raise InputError(
            f"mechanism.beam.shares lists {len(beam.shares)} pieces, the centre line has {len(line) - 1}; "
            "give [] for a piece without stations"
        )
    else:
        places = stations(line, beam.shares)
    return Strip(line, beam.width, np.array(beam.values) + beam.offset, places)


def chain_of(spec: SliderCrankSpec) -> Chain:
    """Return the chain that a specification's fidelity asks for; of a solid the one that it is drawn from."""
    mechanism, made_of = spec.mechanism, elasticity(spec.mechanism)
    if spec.piece == "beam":
        direction = linkage_of(mechanism).travel_direction
        return strip_chain(strip_of(mechanism), made_of, pins_of(mechanism), direction)
    return chain_of_flexures(flexures_of(mechanism), made_of, *unloaded_linkage(mechanism))


def chain_of_flexures(parts: Sequence[Flexure], made_of: Elasticity, linkage: Linkage, unloaded: float) -> Chain:
    """Return given flexures, with rigid links between them, as a chain to press."""
    pins = joints(linkage, unloaded)
    ends = flexure_ends(pins, [part.length for part in parts], [part.before for part in parts])

    def knee(path: Path, index: int) -> FloatArray:
        dx, dy, turn = path.motion("crank")[index]
        x, y = pins[1] - ends[1]  # the crank is rigid and takes its pin along
        cosine, sine = np.cos(turn), np.sin(turn)
        place: FloatArray = ends[1] + np.array([dx + cosine * x - sine * y, dy + sine * x + cosine * y])
        return place

    return Chain(ends, pins, lambda points: flexure_network(points, parts, made_of), linkage.travel_direction, knee)


def pins_of(mechanism: Mechanism) -> FloatArray:
    """Return the three points of a chain that say where it is kinked, (3, 2) [m].

    Pivot, crank pin and slider pin; of a strip with a centre line of its own the ends, and between them the corner
    farthest off the line through them, or the middle of a straight one.
    """
    line = None if mechanism.beam is None else mechanism.beam.centreline
    if line is None:
        return joints(*unloaded_linkage(mechanism))
    points = np.array(line)
    off = [abs(kink(np.array([points[0], point, points[-1]]))) for point in points[1:-1]]
    middle = points[1 + int(np.argmax(off))] if off else 0.5 * (points[0] + points[-1])
    return np.array([points[0], middle, points[-1]])


def strip_chain(strip: Strip, made_of: Elasticity, pins: FloatArray, direction: float) -> Chain:
    """Return a strip as a chain to press, kinked as three points of it say, in a direction of travel [rad]."""

    def build(points: FloatArray) -> Network:
        return Strip(points, strip.width, strip.thickness, strip.places).network(made_of)

    looked_up: list[tuple[Path, int, FloatArray]] = []  # of the path asked last: it is asked once for every point

    def knee(path: Path, index: int) -> FloatArray:
        if not looked_up or looked_up[0][0] is not path:
            before = _unloaded_samples(path)
            nearest = int(np.hypot(*(before - pins[1]).T).argmin())
            looked_up[:] = [(path, nearest, pins[1] - before[nearest])]
        _, row, offset = looked_up[0]
        place: FloatArray = offset + path.shape(STRIP_BEAM, index)[row]
        return place

    return Chain(strip.corners, pins, build, direction, knee)


def _unloaded_samples(path: Path) -> FloatArray:
    """Return where the samples of a strip lie before any load, (k, 2) [m].

    The strip passes a kink on a chord, and a little off the crank pin: motions are those of its own points.
    """
    line = np.asarray(path.network.beams[STRIP_BEAM].shape.points)  # type: ignore[union-attr]
    marks = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    place = path.places(STRIP_BEAM) * marks[-1]
    return np.column_stack([np.interp(place, marks, line[:, 0]), np.interp(place, marks, line[:, 1])])
