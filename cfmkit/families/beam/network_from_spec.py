"""From a specification to the network, masses, drive and path controls of the beam engine; stages in series, mirrors.

The closure "chain": beams keep their shapes and lengths, and the nodes go where the beams end. From the nodes that are
held in place, each beam in the given order whose one end is placed carries its other end with it; a beam between two
nodes that are placed already is turned and scaled. A guided node is carried like a free one: its guide goes with it, as
in the reference values of Table 3.

Stages in series: each stands, with its supports, on the moving part of the one before [Lan, Fig. 15]. They carry the
same force and add their displacements. All of them are in the network, so that a stack in which one stage snaps ahead
of the others is found like any other bifurcation.

[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010).
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit import elastica as engine
from cfmkit.arrays import ShortRepr
from cfmkit.elastica.model.beam import fit
from cfmkit.elastica.model.network import FREE_SUPPORT, Link, Network, Node
from cfmkit.families.beam.contact_spec import contacts_of
from cfmkit.families.beam.network_elements_spec import (
    HELD_MOTIONS,
    DisplacementDrive,
    ForceDrive,
    LoadsDrive,
    MomentDrive,
    RotationDrive,
)
from cfmkit.families.rows import with_values
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.network import LoadOn
    from cfmkit.elastica.vibration import NetworkMasses
    from cfmkit.families.beam.mechanism_spec import Mechanism
    from cfmkit.families.beam.network_elements_spec import MemberSpec, NodeSpec, Thickness
    from cfmkit.families.beam.spec import BeamSpec


_LARGEST_TURN = 0.35  # of a rotation in one step [rad]
_ON_AXIS = 0.5  # thicknesses from the mirror axis within which a node is on it
_SMOOTH_PITCH_SHARE = 0.07  # the same where every step is a point of the curve


@dataclass(frozen=True)
class Mirror:
    """Axis about which the half of a part that is described is mirrored."""

    at: complex  # a point of it [m]
    direction: float  # [rad]

    def reflect(self, points: FloatArray) -> FloatArray:
        """Return the images of points (..., 2) [m]."""
        turn = np.exp(1j * self.direction)
        z = self.at + turn * np.conj((points @ np.array([1, 1j]) - self.at) / turn)
        return np.stack([z.real, z.imag], axis=-1)

    def reflect_motion(self, motion: FloatArray) -> FloatArray:
        """Return the images of motions or loads of nodes (..., 3): along x, along y, about the node."""
        along = Mirror(0j, self.direction).reflect(motion[..., :2])
        return np.concatenate([along, -motion[..., 2:]], axis=-1)


@dataclass(frozen=True, repr=False)
class Assembly(ShortRepr):
    """A mechanism as the engine takes it."""

    spec: BeamSpec  # what it was built from
    network: engine.Network  # one half, or one leg; all stages in series
    driven: str  # the node that is driven, in the last stage
    # how many of the network act side by side: forces of the mechanism are so many times those of the network
    parallel: int
    allowable_stress: float | None  # yield strength over safety factor, the smallest of all beams [Pa]

    @property
    def direction(self) -> float:
        """Direction of the drive [rad], exactly that of the support where the node slides; of a rotation, none."""
        asked = float(getattr(self.spec.mechanism.drive, "direction", 0.0))
        support = self.network.nodes[self.driven].support
        if not support.across:
            return asked
        return support.direction if math.cos(asked - support.direction) > 0 else support.direction + math.pi

    @property
    def mirror(self) -> Mirror | None:
        """Axis of the mirrored half, which runs along the drive; None if nothing is mirrored."""
        copies = self.spec.mechanism.copies
        return None if copies is None or copies.mirror is None else Mirror(complex(*copies.mirror), self.direction)

    def add_images(self, lines: Sequence[FloatArray]) -> list[FloatArray]:
        """Return lines (..., 2) of what is described [m], and then those of its mirrored half."""
        return [*lines, *(self.mirror.reflect(line) for line in lines)] if self.mirror is not None else list(lines)

    @property
    def moving_nodes(self) -> set[str]:
        """Nodes that the drive moves: its own, and those of further stages, which have a number behind a dot."""
        first = self.spec.mechanism.drive.node
        return {node for node in self.network.nodes if node.split(".")[0] == first}

    def stands(self, node: str) -> bool:
        """Return True if a node is held in all its motions, and not driven."""
        support = self.network.nodes[node].support
        return support.along and support.across and support.rotation and node not in self.moving_nodes

    @property
    def thinnest(self) -> float:
        """Smallest thickness of all beams [m]."""
        return min(beam.section.thinnest for beam in self.network.beams.values())

    @property
    def _even_places(self) -> FloatArray:
        return np.linspace(0.0, self.spec.extent, self.spec.analysis.points)

    @property
    def places(self) -> FloatArray:
        """Motions that are requested, in the order of the drive: those of the curve, and ends of windows between."""
        even, extent = self._even_places, self.spec.extent
        if self.spec.analysis.through_folds:
            return even
        ends = np.array([end for _, window in self.spec.windows() for end in window_places(window, (0.0, extent))])
        close = 1e-6 * abs(extent) / len(even)  # an end that all but meets a point needs none of its own
        apart = np.abs(ends[:, None] - even).min(axis=1, initial=np.inf) > close
        inside = apart & (ends * np.sign(extent) > 0) & (np.abs(ends) < abs(extent))
        return np.array(sorted({*even.tolist(), *ends[inside].tolist()}, key=abs))

    @property
    def on_curve(self) -> NDArray[np.bool_]:
        """Which of `places` are points of the curve."""
        even = set(self._even_places.tolist())
        return np.array([place in even for place in self.places.tolist()])

    def drive(self) -> engine.Displacement | engine.Rotation | engine.Loading:
        """Return what is done to the network, from rest to the end: at even steps, and where windows end between."""
        spec, drive = self.spec, self.spec.mechanism.drive
        points = self.places if drive.by_motion else self._even_places
        match drive:
            case DisplacementDrive():
                return engine.Displacement(self.driven, self.direction, points, self.growing(spec.extent))
            case RotationDrive():
                return engine.Rotation(self.driven, points, self.growing(spec.extent))
            case LoadsDrive():
                return engine.Loading((*(load.build() for load in drive.loads), *self.growing(spec.extent)), points)
            case MomentDrive():
                drive_load = engine.PointLoad(self.driven, moment=1.0)
            case ForceDrive():
                x, y = math.cos(self.direction), math.sin(self.direction)
                drive_load = engine.PointLoad(self.driven, x, y, follows=drive.follows)
        return engine.Loading((drive_load, *self.growing(spec.extent / self.parallel)), points / self.parallel)

    @property
    def effort_unit(self) -> float:
        """Force or moment of all copies for one of the engine; of a drive by loads its reference [N]."""
        drive = self.spec.mechanism.drive
        return drive.reference if isinstance(drive, LoadsDrive) else float(self.parallel)

    def masses(self) -> NetworkMasses | None:
        """Return what the parts weigh; None if a density is not known."""
        mechanism = self.spec.mechanism
        # stages in series have the names of the first, with a number behind a dot
        stated_materials = mechanism.collect_beam_values("material")
        materials = {name: stated_materials[name.split(".")[0]] for name in self.network.beams}
        density = {name: material.density for name, material in materials.items() if material.density is not None}
        if len(density) < len(materials):
            return None
        from cfmkit.elastica.vibration import NetworkMasses

        nodes = {name: mechanism.nodes[name.split(".")[0]] for name in self.network.nodes}
        return NetworkMasses(density, {name: (node.mass or 0.0, node.inertia or 0.0) for name, node in nodes.items()})

    def hold(self) -> tuple[str, float | None]:
        """Return what stands still while the drive is held: a node, along a direction [rad] or turned (None)."""
        return self.driven, None if self.spec.mechanism.drive.turns else self.direction

    def growing(self, end: float) -> tuple[LoadOn, ...]:
        """Return the constant loads per unit of the drive, where they grow with it and are whole at its end."""
        if self.spec.analysis.loads_first:
            return ()
        return tuple(load.build(1.0 / end) for load in self.spec.mechanism.loads)

    def control(self) -> engine.Control:
        """Return how the path is followed."""
        analysis = self.spec.analysis
        return engine.Control(
            tolerance=analysis.tolerance,
            through_folds=analysis.through_folds,
            largest_turn=_SMOOTH_PITCH_SHARE if analysis.through_folds else _LARGEST_TURN,
            branch=analysis.branch,
            sign=-1 if analysis.other_side else 1,
            imperfection=analysis.imperfection,
        )


def assemble(spec: BeamSpec) -> Assembly:
    """Return the mechanism that a specification describes, as the engine takes it."""
    mechanism, copies = spec.mechanism, spec.mechanism.copies
    network = engine.Network(
        nodes={name: _engine_node(node) for name, node in mechanism.nodes.items()},
        beams={name: _engine_beam(spec, beam) for name, beam in mechanism.beams.items()},
        links=tuple(engine.Link(link.master, link.node) for link in mechanism.links),
        springs=tuple(spring.build() for spring in mechanism.springs.values()),
        loads=tuple(load.build() for load in mechanism.loads) if spec.analysis.loads_first else (),
        contacts=contacts_of(mechanism),
    )
    if mechanism.closure == "chain":
        network = move_free_nodes(network)
    driven = mechanism.drive.node
    if copies is not None and copies.layers > 1:
        network, driven = stack_stages(network, driven, copies.layers, copies.layer_pitch)
    is_mirrored = copies is not None and copies.mirror is not None
    strengths = known_allowable_stresses(spec)
    allowable = min(strengths.values()) if len(strengths) == len(mechanism.beams) else None
    return Assembly(spec, network, driven, mechanism.legs * (2 if is_mirrored else 1), allowable)


def node_place(network: Network, name: str) -> FloatArray:
    """Return where a node is before any load, (2,) [m]."""
    node = network.nodes[name]
    return np.array([float(np.real(node.x)), float(np.real(node.y))])


def is_on_axis(assembly: Assembly, node: str) -> bool:
    """Return True if a node is on the mirror axis, by the thickness of the beams that meet there."""
    place, mirror = assembly.network.nodes[node], assembly.mirror
    if mirror is None:
        return False
    away = ((complex(place.x, place.y) - mirror.at) / np.exp(1j * mirror.direction)).imag
    beams = assembly.network.beams.values()
    joined_beams = [beam for beam in beams if node in (beam.start, beam.end)] or beams
    return bool(abs(away) < _ON_AXIS * max(thickest_of(beam.section) for beam in joined_beams))


def constant_load(assembly: Assembly, node: str) -> FloatArray:
    """Return the constant point loads on a node (3,): force x, y [N], moment [N m]."""
    loads = [load for load in assembly.network.loads if isinstance(load, engine.PointLoad) and load.node == node]
    components = np.array([(load.fx, load.fy, load.moment) for load in loads], dtype=float).reshape(-1, 3)
    return np.asarray(components.sum(axis=0))


def known_allowable_stresses(spec: BeamSpec) -> dict[str, float]:
    """Return yield strength over safety factor of the beams whose strength is known, by name [Pa]."""
    materials, factor = spec.mechanism.collect_beam_values("material"), spec.mechanism.safety_factor
    limits = {name: material.allowable(factor) for name, material in materials.items()}
    return {name: limit for name, limit in limits.items() if limit is not None}


def thickest_of(section: engine.Section) -> float:
    """Return the largest thickness of a section as the engine has it [m]."""
    thickness = section.thickness
    return float(thickness if isinstance(thickness, float | int) else np.max(thickness.values))


def _engine_node(node: NodeSpec) -> engine.Node:
    moved = (0.0, 0.0, 0.0)
    if node.moved is not None:
        moved = (node.moved.along, node.moved.across, node.moved.rotation)
    return engine.Node(*node.at, engine.Support(*HELD_MOTIONS[node.support], node.direction or 0.0, moved))


def _engine_beam(spec: BeamSpec, beam: MemberSpec) -> engine.Beam:
    mechanism = spec.mechanism
    of = beam.material or mechanism.material
    section = engine.Section(
        of.modulus,
        beam.width or mechanism.width,
        _engine_thickness(beam.thickness or mechanism.thickness),
        axial=spec.fidelity != "inextensible" or is_between_held_places(mechanism, beam),
        shear=spec.fidelity in ("reissner", "solid"),
        poisson_ratio=of.poisson,
        wide=mechanism.wide_beams,
    )
    return engine.Beam(
        beam.start,
        beam.end,
        section,
        beam.shape.build(),
        "raw" if mechanism.closure == "raw" and getattr(beam.shape, "length", None) else "rotscale",
        beam.start_joint,
        beam.end_joint,
        beam.start_offset or (0.0, 0.0),
        beam.end_offset or (0.0, 0.0),
    )


def is_between_held_places(mechanism: Mechanism, beam: MemberSpec) -> bool:
    """Return True for a straight beam between two places that do not move.

    Without stretching it could not even bend, and its axial force would be any: the whole network would be rigid.
    """
    ends = [mechanism.nodes[name] for name in (beam.start, beam.end)]
    held = all(all(HELD_MOTIONS[node.support][:2]) and node.moved is None for node in ends)
    return held and beam.shape.is_straight and not (beam.start_offset or beam.end_offset)


def _engine_thickness(thickness: Thickness) -> float | engine.Taper:
    if isinstance(thickness, tuple):
        return engine.Taper(np.array([place for place, _ in thickness]), np.array([value for _, value in thickness]))
    return thickness


def resolve(spec: BeamSpec) -> BeamSpec:
    """Return the specification with everything derived written out: the model and what counts as stress."""
    fidelity = spec.fidelity
    model = {"mechanism.axial": fidelity != "inextensible", "mechanism.shear": fidelity in ("reissner", "solid")}
    return with_values(spec, {**model, "analysis.fidelity": fidelity, "analysis.stress": spec.stress})


def change_at(block: Any, path: str, change: Callable[[Any], Any]) -> Any:
    """Return a block with what is at a dotted path changed, of every item where the path has *; if there is anything.

    Nothing is validated: values may be complex.
    """
    if block is None or not path:
        return block if block is None else change(block)
    head, _, rest = path.partition(".")
    if isinstance(block, dict):
        return {name: change_at(item, rest, change) if head in ("*", name) else item for name, item in block.items()}
    if isinstance(block, tuple):
        return tuple(change_at(item, rest, change) if head in ("*", str(k)) else item for k, item in enumerate(block))
    if getattr(block, head, None) is None:
        return block
    return block.model_copy(update={head: change_at(getattr(block, head), rest, change)})


def move_free_nodes(network: Network) -> Network:
    """Return the network with its free nodes moved to where the beams end."""
    placed = {
        name: complex(node.x, node.y)
        for name, node in network.nodes.items()
        if node.support.along and node.support.across
    }
    waiting = dict(network.beams)
    while ready := [name for name, beam in waiting.items() if beam.start in placed or beam.end in placed]:
        beam = waiting.pop(ready[0])
        chord = _own_chord(network, beam)
        if beam.end not in placed:
            placed[beam.end] = placed[beam.start] + complex(*beam.start_offset) + chord - complex(*beam.end_offset)
        elif beam.start not in placed:
            placed[beam.start] = placed[beam.end] + complex(*beam.end_offset) - chord - complex(*beam.start_offset)
    nodes = {
        name: replace(node, x=placed[name].real, y=placed[name].imag) if name in placed else node
        for name, node in network.nodes.items()
    }
    return replace(network, nodes=nodes)


def _own_chord(network: Network, beam: Beam) -> complex:
    """Return the vector between the ends of a beam as its shape is given [m]; as fitted where it has no own length."""
    start, end = network.nodes[beam.start], network.nodes[beam.end]
    reach = complex(end.x - start.x, end.y - start.y) + complex(*beam.end_offset) - complex(*beam.start_offset)
    if getattr(beam.shape, "length", None) is None:
        return reach
    fit_of_shape = fit(beam, (reach.real, reach.imag))
    return reach * cmath.exp(-1j * float(np.real(fit_of_shape.rotation))) / float(np.real(fit_of_shape.scale))


_PITCH_MARGIN = 1.15  # of the pitch that is chosen, for what joins the stages


def stack_stages(
    network: Network,  # one stage, of beams and links; all supports but that of `driven` are clamped
    driven: str,  # its moving part
    count: int,  # number of stages; those after the first have names with ``.2``, ``.3``,
    pitch: float | None = None,  # distance of the stages along the way of the moving part [m]
) -> tuple[Network, str]:
    """Return `count` equal stages in series, and the moving part of the last."""
    nodes, beams, links = dict(network.nodes), dict(network.beams), list(network.links)
    dx, dy = _step(network, driven, pitch)
    for stage in range(2, count + 1):
        below = _name_node(driven, stage - 1)
        for name, node in network.nodes.items():
            clamped = node.support.along and name != driven
            support = FREE_SUPPORT if clamped else node.support
            nodes[_name_node(name, stage)] = Node(node.x + (stage - 1) * dx, node.y + (stage - 1) * dy, support)
            if clamped:
                links.append(Link(below, _name_node(name, stage)))
        for name, beam in network.beams.items():
            start, end = (_name_node(node, stage) for node in (beam.start, beam.end))
            beams[_name_node(name, stage)] = replace(beam, start=start, end=end)
        links += [Link(_name_node(link.master, stage), _name_node(link.node, stage)) for link in network.links]
    return Network(nodes, beams, tuple(links)), _name_node(driven, count)


def _name_node(name: str, stage: int) -> str:
    return name if stage == 1 else f"{name}.{stage}"


def _step(network: Network, driven: str, pitch: float | None) -> tuple[float, float]:
    """Return the vector from one stage to the next: along the way of the moving part, away from the supports."""
    top = network.nodes[driven]
    c, s = math.cos(top.support.direction), math.sin(top.support.direction)
    grounds = [node for name, node in network.nodes.items() if node.support.along and name != driven]
    ahead = [(top.x - node.x) * c + (top.y - node.y) * s for node in grounds]
    mean = sum(ahead) / len(ahead) if ahead else 0.0
    size = math.copysign(_PITCH_MARGIN * max(map(abs, ahead), default=0.0) if pitch is None else pitch, mean)
    return size * c, size * s
