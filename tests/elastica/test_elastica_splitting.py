"""A network whose beams are cut in two at random places, joined by rigid nodes there, is the same network."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import cfmkit.elastica as el
from cfmkit.elastica.model.beam import BEAM_QUADRATURE
from cfmkit.elastica.model.beam_fits import BeamFits, beam_end_at

DRIVE = el.Displacement("d", -np.pi / 2, np.array([2e-3, 6e-3]))
FINE = el.Control(tolerance=1e-10)


def whole() -> el.Network:
    """Curved, tapered and straight beams with an offset, a pin, a linked node, a spring, dead loads."""
    section = el.Section(2e9, 8e-3, el.Taper(np.array([0, 0.4, 1]), np.array([1.0e-3, 1.4e-3, 0.9e-3])), shear=True)
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(0.05, 0.03),
        "bb": el.Node(0.055, 0.03),
        "c": el.Node(0.09, 0.0, el.PINNED_SUPPORT),
        "d": el.Node(0.06, 0.07, el.slider_support(np.pi / 2)),
    }
    beams = {
        "ab": el.Beam("a", "b", section, el.Polynomial((0.0, 0.8, -0.5))),
        "bc": el.Beam("bb", "c", section, el.arc(-0.7), end_joint="pin"),
        "bd": el.Beam("b", "d", section, el.Polynomial((0.0, -0.4, 0.3, 0.2)), start_offset=(0.0, 0.004)),
    }
    loads = (el.PointLoad("b", 0.1, -0.2), el.LineLoad("ab", 2.0, -4.0), el.LineLoad("bd", 1.0, 1.0))
    return el.Network(nodes, beams, (el.Link("b", "bb"),), (el.TorsionSpring(None, "b", 0.02),), loads)


def halves(taper: el.Taper, u: float) -> tuple[el.Taper, el.Taper]:
    """Return the tapers of the parts before and after a fraction of the length."""
    there = float(np.interp(u, taper.stations, taper.values))
    before = taper.stations < u
    return (
        el.Taper(np.append(taper.stations[before] / u, 1.0), np.append(taper.values[before], there)),
        el.Taper(
            np.append(0.0, (taper.stations[~before] - u) / (1 - u)), np.append(there, np.array(taper.values)[~before])
        ),
    )


def cut(net: el.Network, name: str, u: float) -> el.Network:
    """Return the network with one beam cut at a fraction of its length."""
    beam = net.beams[name]
    fitted, angle = BeamFits(net)[name], np.polynomial.Polynomial(beam.shape.coefficients)  # type: ignore[union-attr]
    places, weights = BEAM_QUADRATURE
    along = fitted.angle(u * places, 0.5)
    x, y = (
        float(start + u * fitted.length * weights @ f(along))
        for start, f in zip(beam_end_at(net, name, 0), (np.cos, np.sin), strict=True)
    )
    shapes = [
        el.Polynomial(tuple(angle(np.polynomial.Polynomial(line)).coef.tolist())) for line in ([0.0, u], [u, 1 - u])
    ]
    sections = [dataclasses.replace(beam.section, thickness=t) for t in halves(beam.section.thickness, u)]  # type: ignore[arg-type]
    middle: Any = f"{name} cut"
    first = dataclasses.replace(
        beam, end=middle, shape=shapes[0], section=sections[0], end_joint="rigid", end_offset=(0.0, 0.0)
    )
    rest = dataclasses.replace(
        beam, start=middle, shape=shapes[1], section=sections[1], start_joint="rigid", start_offset=(0.0, 0.0)
    )
    beams = {key: value for key, value in net.beams.items() if key != name}
    loads = [load for load in net.loads if getattr(load, "beam", None) != name]
    for load in net.loads:
        if getattr(load, "beam", None) == name:
            loads += [dataclasses.replace(load, beam=part) for part in (f"{name} 1", f"{name} 2")]  # type: ignore[arg-type, call-arg]
    nodes = {**net.nodes, middle: el.Node(x, y)}
    return el.Network(nodes, {**beams, f"{name} 1": first, f"{name} 2": rest}, net.links, net.springs, tuple(loads))


@given(places=st.lists(st.floats(0.1, 0.9), min_size=3, max_size=3))
@settings(max_examples=4, deadline=None)
def test_cutting_all_beams_at_drawn_places_changes_nothing(places: list[float]) -> None:
    net, parts = whole(), whole()
    for name, place in zip(net.beams, places, strict=True):
        parts = cut(parts, name, place)
    one, other = (el.trace(each, DRIVE, FINE) for each in (net, parts))
    assert one.status is other.status is el.PathStatus.COMPLETE
    here, there = one.at_requested, other.at_requested
    np.testing.assert_allclose(other.effort[there], one.effort[here], rtol=2e-8)
    np.testing.assert_allclose(other.energy[there], one.energy[here], rtol=2e-8)
    np.testing.assert_allclose(other.peak_stress().value[there], one.peak_stress().value[here], rtol=2e-7)
    for node in net.nodes:
        np.testing.assert_allclose(other.motion(node)[there], one.motion(node)[here], atol=1e-9)
    for name in net.beams:
        np.testing.assert_allclose(other.end_force(f"{name} 1", 0)[there], one.end_force(name, 0)[here], atol=1e-8)
        np.testing.assert_allclose(other.end_force(f"{name} 2", 1)[there], one.end_force(name, 1)[here], atol=1e-8)
    np.testing.assert_array_equal(other.unstable[there], one.unstable[here])
