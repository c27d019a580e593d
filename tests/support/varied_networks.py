"""Networks by their design variables: Lan's, one with arms and offsets, and one in which everything varies."""

from __future__ import annotations

from typing import Any

import numpy as np
from lan_2010 import SHAPES, half

import cfmkit.elastica as el

LAN = np.array([1.877, 3.05, 1.244, 2.40, 1.3092, -1.5707, -0.7560, 1.5707, 0.3013, 1.5707, 0.226, -1.148, 1.0, 2.0])


def lan(x: Any) -> el.Network:
    """Node positions [cm], shape coefficients, thickness [mm] and modulus [GPa] of Lan's network, extensible."""
    nodes = {"n3": (x[1] * 1e-2, x[0] * 1e-2), "n4": (x[2] * 1e-2, x[3] * 1e-2)}
    varied = {name: (shape[0], x[4 + 2 * k], x[5 + 2 * k]) for k, (name, (_, _, shape)) in enumerate(SHAPES.items())}
    return half(el.Section(x[13] * 1e9, 10e-3, x[12] * 1e-3), nodes=nodes, coefficients=varied)


def lan_pushed(x: Any) -> Any:
    return lan(x), el.Displacement("n5", -np.pi / 2, np.array([2e-3, 6e-3]))


def arms(x: Any) -> Any:
    """A tapered beam on a rigid arm, with its weight, and a linked node whose places vary."""
    section = el.Section(2e9, 8e-3, el.Taper(np.array([0, 0.5, 1]), np.array([1e-3, x[0], 1.2e-3])), shear=True)
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(0.05, 0.02),
        "bb": el.Node(0.05 + x[1], 0.02 + x[2]),
        "c": el.Node(0.1, 0.0, el.CLAMPED_SUPPORT),
        "d": el.Node(0.06, 0.08, el.slider_support(np.pi / 2)),
    }
    beams = {
        "ab": el.Beam("a", "b", section, el.Polynomial((0.0, 0.7)), end_offset=(x[3], 0.001)),
        "bc": el.Beam("bb", "c", section, end_joint="pin"),
        "bd": el.Beam("b", "d", section),
    }
    network = el.Network(nodes, beams, links=(el.Link("b", "bb"),), loads=(el.LineLoad("ab", 20.0, -60.0),))
    return network, el.Displacement("d", -np.pi / 2, np.array([2e-3, 6e-3]))


def pinned(x: Any) -> Any:
    """Two beams that meet at a pin with a torsion spring."""
    section = el.Section(2e9, 8e-3, 1e-3)
    nodes = {
        "a": el.Node(0.0, 0.0, el.CLAMPED_SUPPORT),
        "b": el.Node(x[1], 0.03),
        "p": el.Node(x[1], 0.03),
        "c": el.Node(0.1, 0.05, el.slider_support(np.pi / 2)),
    }
    beams = {"ab": el.Beam("a", "b", section, el.Polynomial((0.0, 0.4))), "pc": el.Beam("p", "c", section)}
    network = el.Network(nodes, beams, (el.Link("b", "p", turns=False),), (el.TorsionSpring("b", "p", x[0]),))
    return network, el.Displacement("c", -np.pi / 2, np.array([2e-3, 6e-3]))


def wide(x: Any, tapered: bool = False) -> Any:
    """A wide strip of any modulus [GPa], width and thickness [mm], Poisson's ratio and turn, and a narrow beam."""
    taper = el.Taper(np.array([0.0, 0.4, 1.0]), np.array([x[2], 0.7 * x[2], x[2]]) * 1e-3)
    section = el.Section(x[0] * 1e9, x[1] * 1e-3, taper if tapered else x[2] * 1e-3, poisson_ratio=x[3], wide=True)
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(x[4] * 1e-2, 0.02),
        "c": el.Node(0.1, 0, el.CLAMPED_SUPPORT),
    }
    narrow = el.Beam("b", "c", el.Section(2e9, 4e-3, x[2] * 1e-3))
    beams = {"ab": el.Beam("a", "b", section, el.arc(x[5])), "bc": narrow}
    network = el.Network(nodes, beams, loads=(el.LineLoad("ab", 0.0, -20.0),))
    return network, el.Displacement("b", -np.pi / 2, np.array([2e-3, 6e-3]))


def wide_and_tapered(x: Any) -> Any:
    return wide(x, tapered=True)


VALUES = {
    "node x": 0.05,
    "node y": 0.02,
    "thickness": 1.1,
    "linked node": 4e-3,
    "offset x": 3e-3,
    "offset y": 2e-3,
    "line spring": 150.0,
    "its free length": 0.045,
    "torsion spring": 0.2,
    "its angle": 0.05,
    "slide spring": 60.0,
    "its direction": 0.4,
    "its place": 1e-3,
    "dead load": -0.2,
    "follower": 0.1,
    "line load": -5.0,
    "support displacement": 4e-4,
    "support direction": 1.5,
    "rise": 6e-3,
    "corner": 0.012,
    "spline point": 0.011,
    "modulus": 1.0,
    "Poisson's ratio": 0.3,
    "coefficient": 0.7,
    "width": 8.0,
}
X, KINDS = np.array(list(VALUES.values())), list(VALUES)


def zoo(x: Any) -> el.Network:
    """A network in which everything varies."""
    section = el.Section(
        x[21] * 2e9, x[24] * 1e-3, el.Taper(np.array([0, 0.5, 1]), np.array([1.0, x[2], 1.2]) * 1e-3), True
    )
    plain = el.Section(x[21] * 2e9, 8e-3, 1e-3, axial=True, shear=True, poisson_ratio=x[22])
    steps = el.Taper(np.array([0, 0.3, 0.3, 0.8, 1]), np.array([1.2, 1.1, 0.8, 0.9, 1.0]) * 1e-3)
    stepped = el.Section(x[21] * 2e9, 8e-3, steps, axial=True, shear=True, poisson_ratio=x[22])
    nodes = {
        "a": el.Node(0, 0, el.Support(True, True, True, displacement=(0.0, x[16], 0.0))),
        "b": el.Node(x[0], x[1]),
        "bb": el.Node(0.05 + x[3], 0.022),
        "c": el.Node(0.1, 0.0, el.CLAMPED_SUPPORT),
        "d": el.Node(0.06, 0.08, el.slider_support(np.pi / 2)),
        "e": el.Node(0.12, 0.05, el.slider_support(x[17], rotates=True)),
        "f": el.Node(-0.02, 0.06, el.CLAMPED_SUPPORT),
    }
    beams = {
        "ab": el.Beam("a", "b", section, el.Polynomial((0.0, x[23])), end_offset=(x[4], x[5])),
        "bc": el.Beam("bb", "c", stepped, el.CosineArch(x[18]), end_joint="pin"),
        "bd": el.Beam("b", "d", section),
        "be": el.Beam("b", "e", plain, el.Polyline(np.array([[0.0, 0.0], [0.03, x[19]], [0.07, 0.03]]))),
        "bf": el.Beam(
            "bb", "f", stepped, el.Spline(np.array([[0.0, 0.0], [0.03, x[20]], [0.05, 0.012], [0.085, 0.0]]))
        ),
    }
    springs = (
        el.LineSpring("b", "d", x[6], x[7]),
        el.LineSpring("bb", None, 40.0, ground=(0.0, 0.05)),
        el.TorsionSpring("b", "e", x[8], x[9]),
        el.SlideSpring("e", x[11], x[10], x[12]),
    )
    loads = (
        el.PointLoad("b", fy=x[13], moment=1e-3),
        el.PointLoad("bb", fx=x[14], follows=True),
        el.LineLoad("ab", 2.0, x[15]),
    )
    return el.Network(nodes, beams, (el.Link("b", "bb"),), springs, loads)


def pushed(x: Any) -> Any:
    return zoo(x), el.Displacement("d", -np.pi / 2, np.array([1e-3, 3e-3]))


def turned(x: Any) -> Any:
    return zoo(x), el.Rotation("e", np.array([-0.1, -0.2]))


def loaded(x: Any) -> Any:
    loads = (
        el.PointLoad("b", 0.2, 3 * x[13], 1e-3 * x[2]),
        el.PointLoad("d", 0, x[13], follows=True),
        el.LineLoad("bf", 1.0, x[15]),
    )
    return zoo(x), el.Loading(loads, np.array([0.5, 1.0]))


ARMS, PIN, WIDE = (
    np.array([1.3e-3, 4e-3, 2e-3, 3e-3]),
    np.array([0.3, 0.05]),
    np.array([2.0, 10.0, 1.0, 0.35, 5.0, 0.7]),
)
BUILDERS: Any = [
    (pushed, X), (turned, X), (loaded, X), (lan_pushed, LAN), (arms, ARMS), (pinned, PIN), (wide, WIDE),
    (wide_and_tapered, WIDE),
]  # fmt: skip
"""Functions from design variables to network and drive, and where to differentiate."""
