"""Random cantilevers of length 1 and EI = 1 among obstacles and stops, each with a load out and back."""

from __future__ import annotations

import numpy as np

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    Beam,
    BeamOnObstacle,
    Loading,
    Network,
    Node,
    NodeOnObstacle,
    PointLoad,
    Section,
    Stop,
    Support,
    arc_edge,
    circle_edge,
    line_edge,
    polyline_edge,
)

HALF_THICKNESS = 0.005
SECTION = Section(1.0, 12.0, 1.0, axial=False, shear=False)
THIN_SECTION = Section(1.2e7, 1.0, 2 * HALF_THICKNESS, axial=False, shear=False)


def with_pads(seed: int) -> tuple[Network, Loading]:
    """Return a cantilever of two to four beams with up to four stops, and pads on obstacles."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 6))
    names = ["root", *(f"n{k}" for k in range(1, count - 1)), "tip"]
    if count == 3:
        names[1] = "mid"
    supports = [CLAMPED_SUPPORT, *(Support() for _ in names[1:])]
    nodes = {name: Node(k / (count - 1), 0.0, supports[k]) for k, name in enumerate(names)}
    beams = {f"b{k}": Beam(names[k], names[k + 1], SECTION) for k in range(count - 1)}
    contacts: list[Stop | NodeOnObstacle] = []
    for number in range(int(rng.integers(1, 5))):
        node = names[1 + int(rng.integers(count - 1))]
        x, stiffness = nodes[node].x, (np.inf if rng.integers(2) else 10 ** rng.uniform(1, 4))
        low, pad = -rng.uniform(0.01, 0.35) * x * x - 0.005, rng.uniform(0.01, 0.1)
        outline = [
            None,
            line_edge((0.0, low - pad), 0.0),
            circle_edge((x + 0.05 * rng.normal(), low - pad - 0.2), 0.2),
            polyline_edge([(-1, low - pad), (0.9 * x, low - pad), (0.9 * x, -9.0)], 0.02),
            arc_edge((x - 0.1, low - pad - 0.4), 0.4, 0.9 * np.pi, 0.2 * np.pi),
        ][int(rng.integers(5))]
        if outline is None:
            contacts.append(Stop(f"s{number}", node, -low, -np.pi / 2 + 0.2 * rng.normal(), stiffness=stiffness))
        else:
            contacts.append(NodeOnObstacle(f"o{number}", node, outline, pad, stiffness))
    up = np.linspace(0, 1, 9)[1:] * rng.uniform(1, 6)
    load = (PointLoad("tip", 0.2 * rng.normal(), -1.0),)
    return Network(nodes, beams, contacts=tuple(contacts)), Loading(load, np.concatenate([up, up[-2::-1], [0.0]]))


def among_discs(seed: int) -> tuple[Network, Loading]:
    """Return a leaf among up to three discs and a floor, which its side and its tip may touch."""
    rng = np.random.default_rng(seed)
    contacts: list[BeamOnObstacle | NodeOnObstacle] = []
    for number in range(int(rng.integers(1, 4))):
        x, radius = rng.uniform(0.25, 0.95), rng.uniform(0.03, 0.15)
        y = -rng.uniform(0.02, 0.35) * x * x - 0.01 - radius
        disc, name = circle_edge((x, y), radius), f"d{number}"
        contacts += [BeamOnObstacle(name, "leaf", disc), NodeOnObstacle(name, "tip", disc, HALF_THICKNESS)]
    if rng.integers(2):
        floor = line_edge((0, -rng.uniform(0.15, 0.4)), 0.0)
        contacts += [BeamOnObstacle("floor", "leaf", floor), NodeOnObstacle("floor", "tip", floor, HALF_THICKNESS)]
    up = np.linspace(0, 1, 7)[1:] * rng.uniform(1, 5)
    load = (PointLoad("tip", 0.2 * rng.normal(), -1.0),)
    nodes = {"root": Node(0.0, 0.0, CLAMPED_SUPPORT), "tip": Node(1.0, 0.0)}
    leaf = Network(nodes, {"leaf": Beam("root", "tip", THIN_SECTION)}, contacts=tuple(contacts))
    return leaf, Loading(load, np.concatenate([up, up[-2::-1], [0.0]]))
