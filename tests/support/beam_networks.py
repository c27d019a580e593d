"""Random networks with every feature of the beam engine, and drives for them."""

from __future__ import annotations

from typing import Any

import numpy as np

import cfmkit.elastica as el

PLACES = {"a": (0.0, 0.0), "b": (0.05, 0.03), "c": (0.1, -0.005), "d": (0.06, 0.075), "e": (0.012, 0.06)}


def shape(rng: Any, chord: float) -> Any:
    """Return one of all shapes."""
    bent = np.column_stack([np.linspace(0, 1, 4), [0.0, *rng.uniform(-0.12, 0.12, 2), 0.0]])
    size = float(rng.uniform(0.02, 0.12) * rng.choice([-1, 1]))
    return [
        el.STRAIGHT_SHAPE,
        el.Polynomial(tuple(rng.uniform(-0.8, 0.8, 4).tolist())),
        el.arc(8 * size),
        el.CosineArch(size * chord),
        el.CosineArch(size * chord, 0.5),
        el.Polyline(bent),
        el.Spline(bent),
    ][int(rng.integers(7))]


def section(rng: Any) -> el.Section:
    """Return a constant, tapered or stepped section; stretching and shearing by chance."""
    thick = 1e-3 * rng.uniform(0.7, 1.5, 4)
    taper = el.Taper(np.array([0, 0.3, 0.3, 1]), thick) if rng.random() < 0.5 else float(thick[0])
    axial, shear = (bool(rng.random() < 0.6) for _ in range(2))
    return el.Section(2e9, 8e-3, taper, axial=axial, shear=shear, poisson_ratio=float(rng.uniform(0, 0.45)))


def _beam(rng: Any, start: str, end: str) -> el.Beam:
    """Return a beam; not at p, which may be a pin on a rigid arm, by chance with offsets and pins."""
    options: dict[str, Any] = {}
    for side, node in (("start", start), ("end", end)):
        if node != "p" and rng.random() < 0.4:
            options[f"{side}_offset"] = tuple(rng.uniform(-0.003, 0.003, 2).tolist())
        if node != "p" and rng.random() < 0.25 and "start_joint" not in options:
            options[f"{side}_joint"] = "pin"
    one, other = (np.array(PLACES.get(node, PLACES["b"])) for node in (start, end))
    return el.Beam(start, end, section(rng), shape(rng, float(np.hypot(*(other - one)))), **options)


def _nodes(rng: Any) -> dict[str, el.Node]:
    at = {name: np.array(place) + rng.uniform(-0.006, 0.006, 2) for name, place in PLACES.items()}

    def held(along: bool, rotation: bool) -> el.Support:
        moved = (4e-4 * float(rng.uniform(-1, 1)) if along else 0.0, 4e-4 * float(rng.uniform(-1, 1)))
        turned = 0.05 * float(rng.uniform(-1, 1)) if rotation else 0.0
        return el.Support(along, True, rotation, float(rng.uniform(-3, 3)), (*moved, turned))

    supports = {
        "a": held(True, bool(rng.random() < 0.6)),
        "b": el.Support(),
        "c": held(*(bool(rng.random() < 0.5) for _ in range(2))),
        "d": el.slider_support(float(rng.uniform(1, 2)), bool(rng.random() < 0.5)),
        "e": el.CLAMPED_SUPPORT if rng.random() < 0.5 else el.PINNED_SUPPORT,
    }
    nodes = {name: el.Node(float(x), float(y), supports[name]) for name, (x, y) in at.items()}
    x, y = at["b"].tolist()
    nodes["bb"] = el.Node(x + float(rng.uniform(-0.004, 0.004)), y + float(rng.uniform(-0.004, 0.004)))
    nodes["p"] = el.Node(x + (0.0 if rng.random() < 0.5 else 0.003), y)
    return nodes


def network(seed: int, follower: bool = True) -> el.Network:
    """Return a network: five beams, a rigid link, one that may be a pin, springs of all kinds, constant loads."""
    rng = np.random.default_rng(seed)
    beams = {a + b: _beam(rng, a, b) for a, b in (("a", "b"), ("bb", "c"), ("b", "d"), ("e", "p"), ("c", "d"))}
    springs = (
        el.LineSpring("b", "d", float(rng.uniform(20, 100)), float(rng.uniform(0.044, 0.05))),
        el.LineSpring("bb", None, 60.0, ground=tuple(rng.uniform(-0.05, 0.1, 2).tolist())),
        el.TorsionSpring(None, "b", 0.1, float(rng.uniform(-0.1, 0.1))),
        el.TorsionSpring("p", "d", 0.1),
        el.TorsionSpring("b", "p", 0.05, 0.02),
        el.SlideSpring("bb", float(rng.uniform(-3, 3)), 80.0, float(rng.uniform(-5e-4, 5e-4))),
    )
    loads = (el.PointLoad("bb", 0.05, -0.1, 5e-4), el.LineLoad("ab", 1.0, -2.0))
    links = (el.Link("b", "bb"), el.Link("b", "p", turns=bool(rng.random() < 0.4)))
    follows = (el.PointLoad("p", 0.05, 0.08, follows=True),) if follower else ()
    return el.Network(_nodes(rng), beams, links, springs, loads + follows)


def drives(net: el.Network, seed: int) -> list[Any]:
    """Return one drive of each kind: along a guide, along any direction, a rotation, loads of all kinds."""
    rng = np.random.default_rng(seed)
    guide = net.nodes["d"].support.direction + (np.pi if rng.random() < 0.5 else 0.0)
    loads = (
        el.PointLoad("bb", *rng.uniform(-0.2, 0.2, 2).tolist(), 2e-3),
        el.PointLoad("d", *rng.uniform(-0.2, 0.2, 2).tolist(), follows=True),
        el.LineLoad("cd", 3.0, 5.0),
    )
    return [
        el.Displacement("d", guide, np.array([5e-4, 1e-3])),
        el.Displacement("b", float(rng.uniform(-3, 3)), np.array([5e-4, 1e-3])),
        el.Rotation("b", np.array([0.05, 0.1]) * rng.choice([-1, 1])),
        el.Loading(loads, np.array([0.3, 1.0])),
    ]
