"""A network of beams as an input deck of Abaqus and CalculiX: elements (B32), supports, links, drive, one large step.

Units are mm, N, MPa. The deck is planar: nothing moves out of the plane. Its Poisson ratio is zero, because beam theory
has no lateral contraction: CalculiX expands beams to bricks, whose ends would hinder it (a wide strip 13 % too stiff).
The shear modulus is then E/2. Beams stretch and shear there, whatever the model of the analysis leaves out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.model.beam_fits import BeamFits, beam_end_at
from cfmkit.elastica.model.drive import Displacement, Rotation
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.beam import Fit
    from cfmkit.elastica.model.network import Network, Support
    from cfmkit.elastica.model.section import Section

MIN_ELEMENTS_PER_BEAM = 24  # along a beam, at least; twice as many change the force of Lan's part by less than 1e-4
RIGID_MODULUS_FACTOR = 100.0  # modulus of rigid links, in that of the beams
NODE_DISTANCE_TOL = 1e-9  # linked nodes closer than this are one [m]
DRIVE_STIFFNESS = "1.E7"
"""Stiffness of the spring between the drive and what it drives [N/mm]; with a decimal point, CalculiX wants one."""
LEVER_LENGTH, N_ARC_LINES = 10.0, 360
"""Length of the lever that turns a node, in thicknesses; lines that its end's way is made of."""
FIRST_INCREMENT_SHARE = 0.02
"""First increment, in those that follow: chains that are almost straight would jump to a higher mode."""
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class DrivenNetwork:
    """A network of beams with what is done to it."""

    name: str  # for files
    network: Network
    drive: Displacement | Rotation  # of rotations the node must not be free to move


@dataclass(frozen=True)
class _Chain:
    """A beam in elements: places of its nodes (2n + 1, 2) [m], thickness of the elements (n,) [m]."""

    places: FloatArray
    thickness: FloatArray
    width: float
    modulus: float


def beam_deck(
    title: str,  # for its heading
    driven: DrivenNetwork,  # without springs, pins, loads and prescribed displacements of supports
    increments: int,  # in which its travel is taken, all alike
) -> bytes:
    """Return a deck of the beams that runs as it is."""
    return ("\n".join(_Lines(title, driven, increments).lines()) + "\n").encode("ascii", "replace")


class _Lines:
    """Numbers of nodes and elements while the lines are written."""

    def __init__(self, title: str, driven: DrivenNetwork, increments: int) -> None:
        self.title, self.network, self.drive, self.increments = title, driven.network, driven.drive, increments
        self.fits = BeamFits(driven.network)
        self.number = _number_nodes(driven.network)
        self.spare = len(driven.network.nodes) + 1
        self.spare_element = 1
        self.moves: list[str] = []
        self.led: list[tuple[str, str]] = []

    def lines(self) -> Iterator[str]:
        chains = {name: self._chain(name) for name in self.network.beams}
        yield "*HEADING"
        yield f"{self.title}, from cfmkit; mm, N, MPa"
        yield "** beams that stretch and shear; no lateral contraction, so the shear modulus is E/2"
        yield "*NODE, NSET=ALL"
        for number in sorted(set(self.number.values())):
            node = next(node for name, node in self.network.nodes.items() if self.number[name] == number)
            yield _node_line(number, (node.x, node.y))
        rows: list[tuple[str, list[tuple[int, int, int]]]] = []
        for name, chain in chains.items():
            beam, inner = self.network.beams[name], len(chain.places) - 2
            numbers = [self.number[beam.start], *range(self.spare, self.spare + inner), self.number[beam.end]]
            self.spare += inner
            for k, place in zip(numbers[1:-1], chain.places[1:-1], strict=True):
                yield _node_line(k, place)
            rows.append((name, [tuple(numbers[k : k + 3]) for k in range(0, len(numbers) - 2, 2)]))
        yield from self._write_elements(chains, rows)
        yield from self._write_links()
        for name, node in self.network.nodes.items():
            yield from self._write_support(name, node.support)
        yield f"*STEP, NLGEOM, INC={100 * self.increments}"
        yield "*STATIC"
        yield f"{FIRST_INCREMENT_SHARE / self.increments:.10g}, 1., 1e-6, {1 / self.increments:.10g}"
        yield "*BOUNDARY"
        yield "ALL, 3, 3, 0"
        yield from self.moves
        for amplitude, move in self.led:
            yield f"*BOUNDARY, AMPLITUDE={amplitude}"
            yield move
        yield "*NODE PRINT, NSET=DRIVE"
        yield "U, RF"
        yield "*NODE FILE, OUTPUT=2D"
        yield "U, RF"
        yield "*EL FILE"
        yield "S"
        yield "*END STEP"

    def _write_elements(
        self, chains: dict[str, _Chain], rows: list[tuple[str, list[tuple[int, int, int]]]]
    ) -> Iterator[str]:
        number = 1
        for index, (name, numbers) in enumerate(rows, start=1):
            chain = chains[name]
            yield f"** beam {name}"
            material = f"MATERIAL-{index}"
            yield f"*MATERIAL, NAME={material}"
            yield "*ELASTIC"
            yield f"{to_border(chain.modulus, 'stress'):.10g}, 0"
            uniform = bool(np.ptp(chain.thickness) <= 1e-12 * chain.thickness.max())
            groups = [numbers] if uniform else [[row] for row in numbers]
            for piece, group in enumerate(groups, start=1):
                elset = f"BEAM-{index}-{piece}"
                yield f"*ELEMENT, TYPE=B32, ELSET={elset}"
                for row in group:
                    yield f"{number}, {', '.join(map(str, row))}"
                    number += 1
                self.spare_element = number
                yield f"*BEAM SECTION, ELSET={elset}, MATERIAL={material}, SECTION=RECT"
                thick = float(chain.thickness[piece - 1])
                yield f"{to_border(chain.width, 'length'):.10g}, {to_border(thick, 'length'):.10g}"
                yield "0, 0, 1"

    def _chain(self, name: str) -> _Chain:
        """Return a beam's nodes and thicknesses: pieces end at corners of the shape and steps of the section."""
        fit, beam = self.fits[name], self.network.beams[name]
        stations = [fit.parameter(float(station)) for station in beam.section.stations[1:-1]]
        breaks = np.unique(np.round(np.concatenate([np.real(fit.course.breaks), stations]), 13))
        marks = [0.0]
        for left, right in pairwise(breaks.tolist()):
            share = float(np.real(fit.arc(right) - fit.arc(left)))
            marks += np.linspace(left, right, max(4, math.ceil(share * MIN_ELEMENTS_PER_BEAM)) + 1)[1:].tolist()
        halves = np.interp(np.arange(2 * len(marks) - 1) / 2, np.arange(len(marks)), marks)
        start = np.array(beam_end_at(self.network, name, 0), float)
        places = np.concatenate([[start], start + np.cumsum([_chord(fit, *half) for half in pairwise(halves)], axis=0)])
        middles = 0.5 * (np.array(marks[1:]) + np.array(marks[:-1]))
        arcs = [float(np.real(fit.arc(float(middle)))) for middle in middles]
        thickness = np.array([float(np.real(beam.section.thickness_at(arc, arc))) for arc in arcs])
        return _Chain(places, thickness, float(beam.section.width), float(beam.section.youngs_modulus))

    def _write_links(self) -> Iterator[str]:
        """Yield rigid links as beams that are `RIGID_MODULUS_FACTOR` times as stiff as the stiffest beam of the
        network.

        CalculiX's rigid bodies do not take nodes of beams.
        """
        section = max((beam.section for beam in self.network.beams.values()), key=_largest_rigidity)
        modulus = RIGID_MODULUS_FACTOR * to_border(section.youngs_modulus, "stress")
        size = to_border(float(np.max(section.thickness_at(np.linspace(0.0, 1.0, 33), 0.5))), "length")
        links = [link for link in self.network.links if self.number[link.node] != self.number[link.master]]
        if not links:
            return
        yield "** rigid links"
        yield "*MATERIAL, NAME=RIGID"
        yield "*ELASTIC"
        yield f"{modulus:.10g}, 0"
        for link in links:
            ends = [self.network.nodes[name] for name in (link.master, link.node)]
            yield "*NODE, NSET=ALL"
            yield _node_line(self.spare, (0.5 * (ends[0].x + ends[1].x), 0.5 * (ends[0].y + ends[1].y)))
            yield "*ELEMENT, TYPE=B32, ELSET=LINKS"
            yield f"{self.spare_element}, {self.number[link.master]}, {self.spare}, {self.number[link.node]}"
            self.spare, self.spare_element = self.spare + 1, self.spare_element + 1
        yield "*BEAM SECTION, ELSET=LINKS, MATERIAL=RIGID, SECTION=RECT"
        yield f"{to_border(float(section.width), 'length'):.10g}, {size:.10g}"
        yield "0, 0, 1"

    def _write_support(self, name: str, support: Support) -> Iterator[str]:
        """Yield what holds and drives a node; prescribed motions go to `moves`."""
        number, drive = self.number[name], self.drive
        along, across, turn, direction = support.along, support.across, support.rotation, support.direction
        if isinstance(drive, Rotation) and drive.node == name:
            turn = False
            yield from self._write_torque_drive(name, float(drive.points[-1]))
        driven = isinstance(drive, Displacement) and drive.node == name
        if isinstance(drive, Displacement) and driven:
            end = float(drive.points[-1])
            direction = drive.direction
            yield from self._write_equation(name, direction, to_border(end, "length"), driven=True)
        elif along and across:
            self.moves.append(f"{number}, 1, 2, 0")
        elif along:
            yield from self._write_equation(name, direction, 0.0)
        if across and (driven or not along):
            yield from self._write_equation(name, direction + 0.5 * math.pi, 0.0)
        if turn:
            self.moves.append(f"{number}, 4, 6, 0")

    def _write_torque_drive(self, name: str, angle: float) -> Iterator[str]:
        """Yield a lever at a node, and the node DRIVE that leads its end around a circle, by springs along x and y.

        CalculiX prints no moment of a node of beams: it is the reaction of DRIVE times the lever.
        """
        node, number = self.network.nodes[name], self.number[name]
        section = max((beam.section for beam in self.network.beams.values()), key=_largest_rigidity)
        size = to_border(float(np.max(section.thickness_at(np.linspace(0.0, 1.0, 33), 0.5))), "length")
        x, y = (to_border(float(coordinate), "length") for coordinate in (node.x, node.y))
        arm, (middle, end, pulling) = LEVER_LENGTH * size, (self.spare, self.spare + 1, self.spare + 2)
        self.spare += 3
        yield (
            f"** the torque is {arm:.10g} mm times the reaction of DRIVE perpendicular to the lever, which initially "
            "lies along x"
        )
        yield "*NODE, NSET=ALL"
        yield f"{middle}, {x + 0.5 * arm:.10g}, {y:.10g}, 0"
        yield f"{end}, {x + arm:.10g}, {y:.10g}, 0"
        yield "*NODE, NSET=DRIVE"
        yield f"{pulling}, {x + arm:.10g}, {y:.10g}, 0"
        yield "*MATERIAL, NAME=LEVER"
        yield "*ELASTIC"
        yield f"{RIGID_MODULUS_FACTOR * to_border(section.youngs_modulus, 'stress'):.10g}, 0"
        yield "*ELEMENT, TYPE=B32, ELSET=LEVER"
        yield f"{self.spare_element}, {number}, {middle}, {end}"
        yield "*BEAM SECTION, ELSET=LEVER, MATERIAL=LEVER, SECTION=RECT"
        yield f"{to_border(float(section.width), 'length'):.10g}, {size:.10g}"
        yield "0, 0, 1"
        for axis, function in ((1, np.cos), (2, np.sin)):
            yield f"*ELEMENT, TYPE=SPRING2, ELSET=FIRM-{axis}"
            yield f"{self.spare_element + axis}, {end}, {pulling}"
            yield f"*SPRING, ELSET=FIRM-{axis}"
            yield f"{axis}, {axis}"
            yield DRIVE_STIFFNESS
            yield f"*AMPLITUDE, NAME=ARC-{axis}"
            shares = np.linspace(0.0, 1.0, N_ARC_LINES + 1)
            places = arm * (function(shares * angle) - function(0.0))
            yield from (f"{share:.10g}, {place:.10g}" for share, place in zip(shares, places, strict=True))
            self.led.append((f"ARC-{axis}", f"{pulling}, {axis}, {axis}, 1."))
        self.spare_element += 3
        self.moves.append(f"{pulling}, 3, 3, 0")

    def _write_equation(self, name: str, direction: float, end: float, driven: bool = False) -> Iterator[str]:
        """Yield a node whose first displacement is that of a node along a direction; end of it [mm]."""
        number, node = self.number[name], self.network.nodes[name]
        terms = [(1, math.cos(direction)), (2, math.sin(direction))]
        terms = sorted((term for term in terms if abs(term[1]) > 1e-12), key=lambda term: -abs(term[1]))
        leader, self.spare = self.spare, self.spare + 1
        yield "*NODE"
        yield _node_line(leader, (node.x, node.y))
        yield "*EQUATION"
        yield str(len(terms) + 1)
        factors = [(number, axis, factor) for axis, factor in terms]
        yield ", ".join(f"{node}, {axis}, {factor:.12g}" for node, axis, factor in [*factors, (leader, 1, -1.0)])
        self.moves.append(f"{leader}, 2, 3, 0")
        if driven:
            yield from self._write_force_drive(leader, end, (node.x, node.y))
        else:
            self.moves.append(f"{leader}, 1, 1, {end:.10g}")

    def _write_force_drive(self, number: int, end: float, place: tuple[float, float]) -> Iterator[str]:
        """Yield the node DRIVE, which is displaced and pulls by a spring: its reaction is the force.

        CalculiX prints no reaction of nodes that carry equations and nothing else.
        """
        pulling, self.spare = self.spare, self.spare + 1
        yield "*NODE, NSET=DRIVE"
        yield _node_line(pulling, place)
        yield "*ELEMENT, TYPE=SPRING2, ELSET=FIRM"
        yield f"{self.spare_element}, {number}, {pulling}"
        yield "*SPRING, ELSET=FIRM"
        yield "1, 1"
        yield DRIVE_STIFFNESS
        self.moves += [f"{pulling}, 1, 1, {end:.10g}", f"{pulling}, 2, 3, 0"]


def _number_nodes(network: Network) -> dict[str, int]:
    """Return numbers of nodes from 1 on; nodes that are linked and stand in one place share theirs."""
    number = {name: k for k, name in enumerate(network.nodes, start=1)}
    for name, node in network.nodes.items():
        master = network.master_of(name)
        lead = network.nodes[master]
        if math.hypot(lead.x - node.x, lead.y - node.y) < NODE_DISTANCE_TOL:
            number[name] = number[master]
    return number


def _largest_rigidity(section: Section) -> float:
    return float(np.max(section.rigidities(np.linspace(0.0, 1.0, 33), 0.5)[0]))


def _node_line(number: int, place: tuple[float, float] | FloatArray) -> str:
    x, y = (to_border(float(coordinate), "length") for coordinate in place)
    return f"{number}, {x:.10g}, {y:.10g}, 0"


def _chord(fit: Fit, left: float, right: float) -> FloatArray:
    """Return the way along a fitted shape between two parameters (2,) [m]."""
    middle, half = 0.5 * (left + right), 0.5 * (right - left)
    t = middle + half * _GAUSS_NODES
    angle, speed = np.real(fit.angle(t, middle)), np.real(fit.speed(t, middle)) * _GAUSS_WEIGHTS * half
    return np.array([float(np.sum(speed * np.cos(angle))), float(np.sum(speed * np.sin(angle)))])
