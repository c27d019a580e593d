"""Many networks of one topology as arrays: designs of a batch, or complex steps of variables."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.network_arrays import fill_arrays, join_held
from cfmkit.elastica.model.beam_fits import BeamFits, fit_networks
from cfmkit.elastica.model.drive import find_driven_node
from cfmkit.elastica.model.network import PointLoad, swings_with_master
from cfmkit.numerics.dual_array import COMPLEX_STEP

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.mechanics.network_arrays import Loaded
    from cfmkit.elastica.model.network import Network

CURLING_TABLES = ("rest", "curl", "hindrance")  # of wide strips


@dataclass(frozen=True, eq=False)
class NetworkDesigns:
    """Arrays of d networks of one topology; real, or with a complex step each."""

    template: Discretisation
    networks: tuple[Loaded, ...]
    fits: list[BeamFits]
    tables: dict[str, Any]  # (d, e, ...), as of `NetworkArrays`
    places: dict[str, Any]  # (d, k, 2)
    held: list[dict[int, Any]]  # as of `NetworkArrays`

    @property
    def count(self) -> int:
        """Number of networks."""
        return len(self.networks)

    @cached_property
    def held_slopes(self) -> FloatArray | None:
        """Derivatives of all unknowns where they are held, (d, size), by complex steps; None if none has any."""
        if all(values is self.held[0] for values in self.held):
            return None
        steps = np.imag(join_held(self.held, self.template.size)) / COMPLEX_STEP
        return steps if steps.any() else None


def set_up(
    template: Discretisation,  # of one of them, or of the network that they differ from
    origin: Loaded,  # what the template was made of
    networks: Sequence[Loaded],  # they may hold complex steps
) -> NetworkDesigns:
    """Return the arrays of networks of one topology, with the elements of a template."""
    pairs, e, driven = tuple(networks), template.elements, find_driven_node(*origin)
    fits = fit_networks([network for network, _ in pairs])
    tables, places, held = fill_arrays(template.numbering, template.scales, e.cuts, pairs, fits, driven)
    if np.any(template.floored):
        tables["axial"] = tables["axial"] + template.floor[:, None]
    return NetworkDesigns(template, pairs, fits, tables, places, held)


def make_up(network: Network) -> Any:
    """Return the make-up of a network: names and kinds of its nodes, beams, joints, supports, links, springs, loads."""
    nodes = [
        (name, node.support.along, node.support.across, node.support.rotation) for name, node in network.nodes.items()
    ]
    beams = [(name, b.start, b.end, b.start_joint, b.end_joint) for name, b in network.beams.items()]
    acting = [
        (type(item), *(getattr(item, name, None) for name in ("node", "start", "end", "beam", "follows")))
        for item in (*network.springs, *network.loads)
    ]
    arms = [swings_with_master(network, link.node) for link in network.links if not link.turns]
    return nodes, beams, network.links, arms, acting, [type(contact) for contact in network.contacts]


def design_of(designs: NetworkDesigns, number: int) -> Discretisation:
    """Return the arrays of one design as a `Discretisation`."""
    template, (network, drive) = designs.template, designs.networks[number]
    loads = [load for load in (*network.loads, *drive.loads) if isinstance(load, PointLoad)]
    return replace(
        template,
        elements=template.elements._replace(**{name: table[number] for name, table in designs.tables.items()}),
        attachments=template.attachments._replace(**{name: at[number] for name, at in designs.places.items()}),
        springs=tuple(at._replace(item=item) for at, item in zip(template.springs, network.springs, strict=True)),
        loads=tuple(at._replace(item=item) for at, item in zip(template.loads, loads, strict=True)),
        contacts=tuple(at._replace(item=network.contacts[at.number]) for at in template.contacts),
        base=join_held([designs.held[number]], template.size)[0],
        fits=designs.fits[number],
    )
