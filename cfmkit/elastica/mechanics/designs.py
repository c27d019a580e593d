"""Many networks of one topology as arrays with a leading axis: designs of a batch, or complex steps of variables.

Most networks have plain beams only (`cfmkit.elastica.model.plain_beams_at_once`: a polynomial angle, one thickness),
and their designs differ in places of nodes, offsets, shapes and sections. Those are set up together, as arrays; others
one by one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.discretise import Discretisation, discretise
from cfmkit.elastica.mechanics.element_tables import plain_tables
from cfmkit.elastica.model.plain_beams_at_once import (
    check_fits,
    chords,
    coefficients_of,
    fit_to_ends,
    is_plain,
    rigidities_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network

TABLE_NAMES = ("angle", "weight", "rigidity", "axial", "shear", "ahead", "length", "line", "gap")
NO_OFFSET = (0.0, 0.0)
CURLING_TABLES = ("rest", "curl", "hindrance")  # of wide strips


@dataclass(frozen=True, eq=False)
class NetworkDesigns:
    """Arrays of d networks of one topology; real, or with a complex step each.

    `tables` are those of `Elements`, `places` origin, arm and frame of `Attachments`, all with the designs as first
    axis; an array that no design changes is left out.
    """

    template: Discretisation
    count: int
    tables: dict[str, Any]  # (d, e, ...)
    places: dict[str, Any]  # (d, k, 2)
    base: Any  # (d, size), None if no design changes it
    each: tuple[Discretisation, ...]  # where they were set up one by one; else empty
    networks: tuple[tuple[Network, Drive], ...]
    coefficients: Any = None  # (d, b, n) of the angles of the beams, where they were set up together


def set_up(
    template: Discretisation,  # of one of them, or of the network that they differ from
    origin: tuple[Network, Drive],  # (Network, Drive): what the template was made of
    networks: Sequence[tuple[Network, Drive]],  # they may hold complex steps
    # how one is set up by itself; as the template was, with one piece a beam, unless given
    make: Callable[[Network, Drive], Discretisation] | None = None,
) -> NetworkDesigns:
    """Return the arrays of networks of one topology."""
    pairs = tuple(networks)
    if _all_plain(template, origin, pairs):
        return _plain(template, origin, pairs)
    alone = make or (lambda net, drive: discretise(net, drive, template.degree, scales=template.scales))
    each = tuple(alone(*pair) for pair in pairs)
    names = (*TABLE_NAMES, *(CURLING_TABLES if template.elements.curl is not None else ()))
    stack = {name: np.array([getattr(one.elements, name) for one in each]) for name in names}
    places = {name: np.array([getattr(one.attachments, name) for one in each]) for name in ("origin", "arm", "frame")}
    return NetworkDesigns(template, len(pairs), stack, places, np.array([one.base for one in each]), each, pairs)


def make_up(network: Network) -> Any:
    """Return what networks of one topology share: nodes, beams, joints, supports, links, and what acts on them."""
    nodes = [
        (name, node.support.along, node.support.across, node.support.rotation) for name, node in network.nodes.items()
    ]
    beams = [(name, b.start, b.end, b.start_joint, b.end_joint) for name, b in network.beams.items()]
    acting = [
        (type(one), *(getattr(one, name, None) for name in ("node", "start", "end", "beam", "follows")))
        for one in (*network.springs, *network.loads)
    ]
    return nodes, beams, network.links, acting, [type(contact) for contact in network.contacts]


def _all_plain(template: Discretisation, origin: tuple[Network, Drive], pairs: Sequence[tuple[Network, Drive]]) -> bool:
    """Return True if all networks have plain beams and differ in nothing but nodes, beams and sections.

    Joints and links are those of one topology: they are not compared.
    """
    network, drive = origin
    return not template.elements.gap.any() and all(
        all(is_plain(beam) and beam.closure != "raw" for beam in net.beams.values())
        and net.springs == network.springs
        and net.loads == network.loads
        and own.loads == drive.loads
        and net.contacts == network.contacts
        for net, own in (origin, *pairs)
    )


def _plain(
    template: Discretisation, origin: tuple[Network, Drive], pairs: Sequence[tuple[Network, Drive]]
) -> NetworkDesigns:
    scales, e = template.scales, template.elements
    n = template.numbering
    names, node, master, ends, inside = list(n.topology.nodes), n.node, n.master, n.beam_ends, n.inside
    spots = np.array([[(net.nodes[name].x, net.nodes[name].y) for name in names] for net, _ in pairs]) / scales.length
    beams = [list(net.beams.values()) for net, _ in pairs]
    every = [beam for each in beams for beam in each]
    shape = len(beams), len(beams[0])
    arm = spots[:, node] - spots[:, master]
    if any(b.start_offset != NO_OFFSET or b.end_offset != NO_OFFSET for b in every):
        offsets = np.array([(b.start_offset, b.end_offset) for b in every]).reshape(*shape, 2, 2)
        arm = arm.astype(np.result_type(arm, offsets))
        arm[:, ends] += offsets / scales.length
    place = spots[:, master]
    reach = (place + arm)[:, ends[:, 1]] - (place + arm)[:, ends[:, 0]]
    coefficients = coefficients_of(every).reshape(*shape, -1)
    drawn = chords(coefficients)
    check_fits(every, np.hypot(reach[..., 0].real, reach[..., 1].real), np.hypot(*map(np.real, drawn)))
    rotation, length = fit_to_ends(*drawn, reach)
    turned = coefficients + rotation[..., None] * (np.arange(coefficients.shape[-1]) == 0)
    rigidities = rigidities_of(every).reshape(3, *shape)
    tables = plain_tables(turned, length * scales.length, rigidities, scales, template.degree, n.row, e.cuts)
    if np.any(template.floored):
        tables["axial"] = tables["axial"] + template.floor[:, None]
    if inside.size:  # bodies between the elements of a beam
        steps = [(tables["weight"] * turn(tables["angle"])).sum(axis=-1) for turn in (np.cos, np.sin)]
        ahead = np.stack(steps, axis=-1)
        for k in np.flatnonzero(e.cuts[:, 1] < 1.0):
            place[:, e.ends[k, 1]] = (place + arm)[:, e.ends[k, 0]] + ahead[:, k]
    frames, base = _supports(template, origin, pairs, [names[k] for k in master])
    if frames is not None:
        frames[:, inside] = template.attachments.frame[inside]
    places = {"origin": place, "arm": arm} | ({} if frames is None else {"frame": frames})
    return NetworkDesigns(template, len(pairs), tables, places, base, (), tuple(pairs), turned)


def _supports(
    template: Discretisation, origin: tuple[Network, Drive], pairs: Sequence[tuple[Network, Drive]], masters: list[str]
) -> tuple[Any, Any]:
    """Return the frames of attachments (d, k, 2) and values of held unknowns (d, size); None if no design has others.

    A node that is driven, but held nowhere, has the frame of the drive.
    """
    names, base = list(dict.fromkeys(masters)), None
    known = [origin[0].nodes[name].support for name in names]
    drives = {getattr(drive, "direction", None) for _, drive in (origin, *pairs)}
    supports = [[net.nodes[name].support for name in names] for net, _ in pairs]
    if len(drives) == 1 and all(own == known for own in supports):
        return None, None
    angle = np.empty((len(pairs), len(names)), complex)
    base = np.zeros((len(pairs), template.size), complex)
    at = {name: template.attachments.frame[masters.index(name)] for name in names}
    for d, ((_, drive), own) in enumerate(zip(pairs, supports, strict=True)):
        for k, (name, support) in enumerate(zip(names, own, strict=True)):
            angle[d, k] = support.direction
            driven = getattr(drive, "node", None) == name and hasattr(drive, "direction")
            if driven and not np.allclose(at[name], (np.cos(support.direction), np.sin(support.direction))):
                angle[d, k] = drive.direction  # type: ignore[union-attr]
            flags = support.along, support.across, support.rotation
            for flag, unknown, value in zip(flags, template.bodies[name], support.displacement, strict=True):
                if flag and template.rate[unknown] == 0.0:
                    base[d, unknown] = value / (1.0 if unknown == template.bodies[name][2] else template.scales.length)
    turn = angle[:, [names.index(name) for name in masters]]
    frames = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    real = not (frames.imag.any() or base.imag.any())
    return (frames.real, base.real) if real else (frames, base)


def design_of(designs: NetworkDesigns, number: int) -> Discretisation:
    """Return the arrays of one design as a `Discretisation`."""
    if designs.each:
        return designs.each[number]
    template = designs.template
    elements = template.elements._replace(**{name: table[number] for name, table in designs.tables.items()})
    attachments = template.attachments._replace(**{name: place[number] for name, place in designs.places.items()})
    base = template.base if designs.base is None else designs.base[number]
    return replace(template, elements=elements, attachments=attachments, base=base)
