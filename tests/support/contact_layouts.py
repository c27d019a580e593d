"""Random cantilevers of length 1 and EI = 1 among obstacles and stops, each with a load out and back."""

from __future__ import annotations

import numpy as np
from contact_paths import HALF, SECTION, THIN

import cfmkit.elastica as el


def with_pads(seed: int) -> tuple[el.Network, el.Loading]:
    """Return a cantilever of two to four beams with up to four stops, and pads on obstacles."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 6))
    names = ["root", *(f"n{k}" for k in range(1, count - 1)), "tip"]
    if count == 3:
        names[1] = "mid"
    supports = [el.CLAMPED_SUPPORT, *(el.Support() for _ in names[1:])]
    nodes = {name: el.Node(k / (count - 1), 0.0, supports[k]) for k, name in enumerate(names)}
    beams = {f"b{k}": el.Beam(names[k], names[k + 1], SECTION) for k in range(count - 1)}
    contacts: list[el.Stop | el.NodeOnObstacle] = []
    for number in range(int(rng.integers(1, 5))):
        node = names[1 + int(rng.integers(count - 1))]
        x, stiffness = nodes[node].x, (np.inf if rng.integers(2) else 10 ** rng.uniform(1, 4))
        low, pad = -rng.uniform(0.01, 0.35) * x * x - 0.005, rng.uniform(0.01, 0.1)
        outline = [
            None,
            el.line_edge((0.0, low - pad), 0.0),
            el.circle_edge((x + 0.05 * rng.normal(), low - pad - 0.2), 0.2),
            el.polyline_edge([(-1, low - pad), (0.9 * x, low - pad), (0.9 * x, -9.0)], 0.02),
            el.arc_edge((x - 0.1, low - pad - 0.4), 0.4, 0.9 * np.pi, 0.2 * np.pi),
        ][int(rng.integers(5))]
        if outline is None:
            contacts.append(el.Stop(f"s{number}", node, -low, -np.pi / 2 + 0.2 * rng.normal(), stiffness=stiffness))
        else:
            contacts.append(el.NodeOnObstacle(f"o{number}", node, outline, pad, stiffness))
    up = np.linspace(0, 1, 9)[1:] * rng.uniform(1, 6)
    load = (el.PointLoad("tip", 0.2 * rng.normal(), -1.0),)
    return el.Network(nodes, beams, contacts=tuple(contacts)), el.Loading(load, np.concatenate([up, up[-2::-1], [0.0]]))


def among_discs(seed: int) -> tuple[el.Network, el.Loading]:
    """Return a leaf among up to three discs and a floor, which its side and its tip may touch."""
    rng = np.random.default_rng(seed)
    contacts: list[el.BeamOnObstacle | el.NodeOnObstacle] = []
    for number in range(int(rng.integers(1, 4))):
        x, radius = rng.uniform(0.25, 0.95), rng.uniform(0.03, 0.15)
        y = -rng.uniform(0.02, 0.35) * x * x - 0.01 - radius
        disc, name = el.circle_edge((x, y), radius), f"d{number}"
        contacts += [el.BeamOnObstacle(name, "leaf", disc), el.NodeOnObstacle(name, "tip", disc, HALF)]
    if rng.integers(2):
        floor = el.line_edge((0, -rng.uniform(0.15, 0.4)), 0.0)
        contacts += [
            el.BeamOnObstacle("floor", "leaf", floor),
            el.NodeOnObstacle("floor", "tip", floor, HALF),
        ]
    up = np.linspace(0, 1, 7)[1:] * rng.uniform(1, 5)
    load = (el.PointLoad("tip", 0.2 * rng.normal(), -1.0),)
    nodes = {"root": el.Node(0.0, 0.0, el.CLAMPED_SUPPORT), "tip": el.Node(1.0, 0.0)}
    leaf = el.Network(nodes, {"leaf": el.Beam("root", "tip", THIN)}, contacts=tuple(contacts))
    return leaf, el.Loading(load, np.concatenate([up, up[-2::-1], [0.0]]))
