"""Arrays of networks of plain beams, one element each: those of a network that is like them, refilled by compiled code.

Networks are like each other if they differ in places, shapes, sections, offsets and strengths alone; the first of a
kind is set up by `discretise`, which is the specification, and where there is no compiler sets up all of them.
"""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics.compiled import CompiledEquations
from cfmkit.elastica.mechanics.compiled_module import load_compiled, make_row
from cfmkit.elastica.mechanics.discretise import Discretisation, discretise, find_straight_floor
from cfmkit.elastica.mechanics.elements import TABLES_AT_POINTS, MechanicsUnits, turns_little
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.model_arrays import term_arrays
from cfmkit.elastica.model.beam import BEAM_QUADRATURE
from cfmkit.elastica.model.beam_fits import NO_OFFSETS, BeamFits, is_plain, section_rigidities
from cfmkit.elastica.model.drive import Displacement
from cfmkit.elastica.model.network import LineLoad, apart

if TYPE_CHECKING:
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network

NO_DISPLACEMENT = (0.0, 0.0, 0.0)
N_BEAM_COLUMNS = 8  # as in compare.c: numbers of a beam before the coefficients of its angle


class _Kind(NamedTuple):
    """Common arrays of networks that are like each other."""

    mesh: Discretisation  # of one of them
    equations: CompiledEquations
    places: Any  # nodes of both ends of every beam, then node and master of every attachment
    parts: tuple[tuple[str, int, int, tuple[int, ...]], ...]  # of what is filled: name, begin, end, shape
    size: int  # of all that


def arrange(network: Network, drive: Drive, degree: int, fits: BeamFits | None = None) -> Discretisation:
    """Return the arrays of a network under a drive as `discretise` does, in one compiled call if beams are plain."""
    described = None if network.contacts or load_compiled() is None else _describe(network, drive)
    if described is None:
        return discretise(network, drive, degree, fits=fits)
    key, spots, beams = described
    kept = _known_kind((degree, key))
    if "kind" not in kept:
        kept["kind"] = _make_kind(discretise(network, drive, degree, fits=fits), beams.shape[1])
    kind: _Kind | None = kept["kind"]
    refilled = kind and _refill(kind, network, drive, fits, spots, beams)
    return refilled or discretise(network, drive, degree, fits=fits)


@lru_cache(maxsize=128)
def _known_kind(key: Any) -> dict[str, Any]:
    """Return what is kept of networks of one kind."""
    return {}


def _describe(network: Network, drive: Drive) -> tuple[Any, Any, Any] | None:
    """Return what is the same in networks that are like this one, and its places (nodes, 2) and beams (b, ...).

    None if it is not plain.
    """
    rows: list[tuple[Any, ...]] = []
    sections: dict[int, Any] = {}
    most = max(len(getattr(beam.shape, "coefficients", ())) or 1 for beam in network.beams.values())
    driven = type(drive), getattr(drive, "node", ""), getattr(drive, "direction", 0.0)
    kinds: list[Any] = [most, *driven, network.links]
    for name, beam in network.beams.items():
        section, offsets = beam.section, (beam.start_offset, beam.end_offset)
        if not (is_plain(beam) and turns_little(beam)) or beam.closure != "rotscale":
            return None
        if network.links and offsets != NO_OFFSETS:
            return None
        coefficients: Any = beam.shape.coefficients  # type: ignore[union-attr]
        floor = 0.0 if section.axial or any(coefficients[1:]) else find_straight_floor(drive)
        kinds += (name, beam.start, beam.end, beam.start_joint, beam.end_joint, *map(any, offsets), floor)
        if id(section) not in sections:
            sections[id(section)] = section_rigidities(section)
        padding = (0.0,) * (most - len(coefficients))
        rows.append((*sections[id(section)], floor, *offsets[0], *offsets[1], *coefficients, *padding))
    for name, node in network.nodes.items():
        if node.support.displacement != NO_DISPLACEMENT:
            return None
        kinds += (name, node.support)
    if not all(link.turns for link in network.links):
        return None
    kinds += [apart(network, link.node) for link in network.links]
    for item in (*network.springs, *network.loads, None, *drive.loads):
        if isinstance(item, LineLoad):
            return None
        names = (getattr(item, name, None) for name in ("node", "start", "end", "follows"))
        kinds += (type(item), *names, bool(getattr(item, "moment", 0.0)))
    spots, beams = np.array([(node.x, node.y) for node in network.nodes.values()]), np.array(rows)
    return (tuple(kinds), spots, beams) if spots.dtype == beams.dtype == float else None


def _make_kind(mesh: Discretisation, width: int) -> _Kind | None:
    """Return what networks like one share, None if they have no compiled equations."""
    compiled, numbering = equations(mesh), mesh.numbering
    if type(compiled) is not CompiledEquations:
        return None
    names, beams = list(mesh.fits.network.nodes), mesh.fits.network.beams.values()
    places = [(names.index(beam.start), names.index(beam.end)) for beam in beams]
    elements, points = mesh.elements.angle.shape
    powers, attachments = width - N_BEAM_COLUMNS, len(numbering.node)
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(TABLES_AT_POINTS, (elements, points))
    shapes |= {"bend": compiled.arrays["bend"].shape, "length": (elements,)}
    shapes |= {"origin": (attachments, 2), "arm": (attachments, 2), "unit": (len(mesh.free),)}
    shapes |= {"laws": (elements, 2 + powers), "scales": (2,)}
    ends = np.cumsum([0, *(int(np.prod(shape)) for shape in shapes.values())]).tolist()
    parts = zip(shapes, itertools.pairwise(ends), shapes.values(), strict=True)
    at = np.concatenate([np.ravel(places), np.stack([numbering.node, numbering.master], axis=1).ravel()])
    return _Kind(
        mesh, compiled, read_only(at, np.int64), tuple((name, *pair, shape) for name, pair, shape in parts), ends[-1]
    )


def _refill(
    kind: _Kind, network: Network, drive: Drive, fits: BeamFits | None, spots: Any, beams: Any
) -> Discretisation | None:
    """Return the arrays of a network that is like another, None if one of its beams cannot be fitted."""
    block, row, old = np.empty(kind.size), kind.equations.row.copy(), kind.mesh
    if not load_compiled().fill(row, kind.places, _quadrature(), spots, beams, block):
        return None
    arrays: dict[str, Any] = {name: block[begin:end].reshape(shape) for name, begin, end, shape in kind.parts}
    length, force = arrays.pop("scales").tolist()
    tables: dict[str, Any] = {name: arrays[name] for name in (*TABLES_AT_POINTS, "length")}
    mesh, exchanged = object.__new__(Discretisation), object.__new__(CompiledEquations)
    vars(mesh).update(
        old.__getstate__(),
        elements=old.elements._replace(**tables),
        attachments=old.attachments._replace(origin=arrays["origin"], arm=arrays["arm"]),
        scales=MechanicsUnits(length, force, length if isinstance(drive, Displacement) else 1.0),
        fits=fits or BeamFits(network),
    )
    if old.springs or old.loads:
        springs = zip(old.springs, network.springs, strict=True)
        loads = zip(old.loads, (*network.loads, *drive.loads), strict=True)
        vars(mesh).update(
            springs=tuple(at._replace(item=item) for at, item in springs),
            loads=tuple(at._replace(item=item) for at, item in loads),
        )
        terms = term_arrays(mesh)
        arrays, row = arrays | terms, make_row(terms, {}, row)
    arrays = {**kind.equations.arrays, **arrays}
    vars(exchanged).update(vars(kind.equations), mesh=mesh, unit=arrays["unit"], arrays=arrays, row=row)
    mesh.cache.update((key, exchanged) for key, made in old.cache.items() if made is kind.equations)
    return mesh


@lru_cache(maxsize=1)
def _quadrature() -> Any:
    return read_only(np.stack(BEAM_QUADRATURE))
