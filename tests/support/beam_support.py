"""Beam mechanisms for the tests: the configurations, and small networks built on the spot."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import cfmkit

CONFIGS = Path(__file__).parents[2] / "configs"
MM = 1e-3

CANTILEVER = """
cfmkit: 1
family: beam
mechanism:
  material: {youngs_modulus: 2.4 GPa, yield_strength: 50 MPa}
  thickness: 1 mm
  width: 100 mm
  nodes:
    root: {at: [0 mm, 0 mm], support: clamped}
    tip: {at: [400 mm, 0 mm]}
  beams:
    beam: {start: root, end: tip}
  drive: {kind: displacement, node: tip, direction: -90 deg}
analysis:
  travel: 100 mm
  points: 21
"""
"""EI = 0.02 N m^2, L = 0.4 m: EI/L^2 = 0.125 N."""

TOGGLE = """
cfmkit: 1
family: beam
name: toggle
mechanism:
  material: {youngs_modulus: 2 GPa, poisson_ratio: 0.35, yield_strength: 28 MPa}
  axial: true
  thickness: 1 mm
  width: 10 mm
  nodes: {root: {at: [0 mm, 0 mm], support: clamped}, top: {at: [50 mm, 5 mm], support: guided, direction: 90 deg}}
  beams: {beam: {start: root, end: top, shape: {kind: polynomial, coefficients: [0 rad, 0.6 rad, -0.6 rad]}}}
  drive: {kind: displacement, node: top, direction: -90 deg}
  copies: {mirror: [50 mm, 0 mm]}
"""
"""Its force falls from 3 mm of travel on and is negative from 7 to 9 mm; its stress is largest half way."""


def config(name, *changes):
    """Return a configuration with changes as ``--set`` takes them."""
    return cfmkit.load(CONFIGS / f"{name}.yaml", changes)


@lru_cache
def solved(name, *changes):
    """Return the result of a configuration; the same for the same changes."""
    return cfmkit.analyze(config(name, *changes))


def cantilever(*pairs, text=CANTILEVER):
    """Return the cantilever with pieces of its text replaced, each of which must be there."""
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return cfmkit.loads(text)


def value(result, name):
    """Return one of the scalar results or metrics in SI."""
    return cfmkit.evaluate(result, [name])[name].value


def warned(result):
    """Return the messages of the warnings of a result, or of a design, by name."""
    return {item.name: item.message for item in result.warnings}


def at(result, displacements, column=None):
    """Return force or another column at samples of the nominal curve [SI]."""
    curve = result.curve
    values = curve.effort if column is None else curve.extra[column].values
    index = [int(abs(curve.motion - place).argmin()) for place in displacements]
    assert abs(curve.motion[index] - displacements).max() < 1e-9
    return values[index]
