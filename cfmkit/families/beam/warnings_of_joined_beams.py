"""Which parts of a beam mechanism its drawing joins although the mechanism does not, as warnings."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.strips_joined_away_from_nodes import DrawnBlock, DrawnStrip, NodesAndBodies, joined_away_from_nodes
from cfmkit.families.beam.finding_names import finding
from cfmkit.families.beam.network_from_spec import is_on_axis, mirror_axis, moving_nodes
from cfmkit.families.beam.strips_and_gaps import mirror_points
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.export.contours import Contour
    from cfmkit.export.strips_joined_away_from_nodes import Join
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.families.beam.strips_and_gaps import BeamStrip
    from cfmkit.results import Finding

MAX_NAMED_PAIRS = 4
"""Pairs that one line names."""


def joined_unasked(
    assembly: Assembly,
    beams: dict[str, list[BeamStrip]],  # the described half
    blocks: Sequence[DrawnBlock],  # pads, eyes and bars of the described half, and bars that join the halves
    contours: Sequence[Contour],  # the outline
    fillet: float,  # its inside corners [m]
) -> Iterator[Finding]:
    """Yield a warning that names what the outline joins although the network has it apart."""
    strips = [_draw_strip(assembly, name, found) for name, found in beams.items()]
    blocks = [*blocks]
    if (axis := mirror_axis(assembly)) is not None:
        strips += [
            DrawnStrip(
                f"{one.name}'", mirror_points(one.points, *axis), one.thickness,
                (_image(assembly, one.ends[0]), _image(assembly, one.ends[1])),
            )
            for one in strips
        ]  # fmt: skip
        blocks += [
            DrawnBlock(
                f"{one.name}'", tuple(_image(assembly, node) for node in one.nodes), mirror_points(one.shape, *axis)
            )
            for one in blocks
            if not any(node.endswith("'") for node in one.nodes)  # bars between the halves are their own image
        ]
    joins = joined_away_from_nodes(strips, blocks, _nodes_and_bodies(assembly), contours, fillet)
    if joins:
        more = f" and {len(joins) - MAX_NAMED_PAIRS} more" if len(joins) > MAX_NAMED_PAIRS else ""
        pairs = ", ".join(_phrase(one) for one in joins[:MAX_NAMED_PAIRS])
        yield finding(
            "joined_away_from_nodes",
            f"drawn as one piece although the mechanism has them apart: {pairs}{more}; the part is stiffer than its "
            "beams: move them apart, or make it in layers",
        )


def pins_drawn_solid(spec: BeamSpec) -> Iterator[Finding]:
    """Yield a warning that names the pins between beams, which the outline does not have."""
    ends = [
        f"{name} at {node}"
        for name, beam in spec.mechanism.beams.items()
        for node, joint in ((beam.start, beam.start_joint), (beam.end, beam.end_joint))
        if joint == "pin"
    ]
    if ends:
        yield finding(
            "pins_not_drawn", f"drawn as one piece with what they turn on: {', '.join(ends)}; add the pins by hand"
        )


def _phrase(join: Join) -> str:
    at = ", ".join(format_short(one, "length") for one in np.round(join.at, 9).tolist())
    pair = f"{join.one} with itself" if join.one == join.other else f"{join.one} and {join.other}"
    filled = f", where fillets fill the gap of {format_short(join.gap, 'length')}" if join.gap > 0 else ""
    return f"{pair} at ({at}){filled}"


def _draw_strip(assembly: Assembly, name: str, found: Sequence[BeamStrip]) -> DrawnStrip:
    beam = assembly.network.beams[name]
    points = np.concatenate([strip.points for strip in found])
    return DrawnStrip(name, points, np.concatenate([strip.thickness for strip in found]), (beam.start, beam.end))


def _image(assembly: Assembly, node: str) -> str:
    """Return the name of a node in the mirrored half: on the axis it is the same."""
    return node if is_on_axis(assembly, node) else f"{node}'"


def _nodes_and_bodies(assembly: Assembly) -> NodesAndBodies:
    """Return the nodes of both halves and their rigid bodies: the ground, and what links and bars join."""
    network, axis, moving = assembly.network, mirror_axis(assembly), moving_nodes(assembly)
    places: dict[str, FloatArray] = {name: np.array([node.x, node.y]) for name, node in network.nodes.items()}
    held = {name for name, node in network.nodes.items() if _stands(assembly, name) and name not in moving}
    pairs = [(link.master, link.node) for link in network.links] + list(combinations(sorted(held), 2))
    if axis is not None:
        pairs += [(_image(assembly, one), _image(assembly, other)) for one, other in pairs]
        pairs += [(name, _image(assembly, name)) for name in sorted(held | moving)]
        places |= {_image(assembly, name): mirror_points(at[None], *axis)[0] for name, at in places.items()}
    return NodesAndBodies(places, _bodies(pairs))


def _stands(assembly: Assembly, node: str) -> bool:
    support = assembly.network.nodes[node].support
    return support.along and support.across and support.rotation


def _bodies(pairs: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Return the body of each node of some pairs that move as one."""
    body: dict[str, str] = {}
    for one, other in pairs:
        kept, gone = body.setdefault(one, one), body.setdefault(other, other)
        body = {node: kept if own == gone else own for node, own in body.items()}
    return body
