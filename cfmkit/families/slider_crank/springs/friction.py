"""Friction of pins and guide in a slider-crank with springs: the way in and the way out differ by it.

Every pin takes a couple mu d/2 |R| against its rotation, R the force that passes through it; with massless links that
is the same force in pivot, crank pin and slider pin. The guide takes what the slider presses across its way. With
coupler and crank in balance about their pins, the force in the coupler is P0 + h P1, h the friction couple of one pin,
and |P0 + h P1| = h/(mu d/2) is a quadratic in h with one positive root. Without one the mechanism holds itself: the
line of force stays inside the friction circles of the pins, as it does next to the stretched position.

Assumes: Coulomb friction, massless links, all pins alike, guide pressed in its middle.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 2 (the linkage).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.springs.sprung_linkage import coupler_angle

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.families.slider_crank.unit_springs import UnitCurves


@dataclass(frozen=True)
class FrictionBranch:
    """One way through the motion, n places, of one mechanism or of m as rows: arrays are (n,) or (m, n)."""

    effort: FloatArray  # torque [N m] or force [N]; NaN where the mechanism holds itself
    coupler: FloatArray  # tension in the coupler, of all legs [N]
    guide: FloatArray  # force on the guide, of all legs, positive upwards [N]; zero for a mirrored pair
    lost: dict[str, FloatArray]  # what ``pins`` and ``guide`` take from the effort [N m or N]


def branch(assembly: Assembly, units: UnitCurves, direction: float) -> FrictionBranch:
    """Return efforts, forces inside and friction's share at the places of unit curves, of one mechanism or of m.

    `direction`: 1 while the motion grows, -1 on the way back.
    """
    link = assembly.linkage
    angle, beta = units.angle, coupler_angle(link, units)
    turns = assembly.rates_over(units.turn) * units.turn
    on_coupler, on_crank = -turns[1] - turns[2], turns[1] - turns[0]
    crank_rate, coupler_rate, slider_rate = _speeds(assembly, angle, beta)
    signs = [np.sign(direction * rate) for rate in (crank_rate, coupler_rate - crank_rate, coupler_rate)]
    rubbing, torque = assembly.rubbing, assembly.drive == "torque"
    sine, cosine = np.sin(beta), np.cos(beta)
    with np.errstate(divide="ignore", invalid="ignore"):
        if torque:
            toward = np.sign(direction * slider_rate)
            along, held = -turns[3] - toward * rubbing.guide.drag, rubbing.guide.friction * toward
            rubbed = _pull_of_pressed_guide(held, along, (sine, cosine), on_coupler, signs, assembly)
        else:
            rows = (link.coupler * np.stack([-sine, cosine]), link.crank * np.stack([-np.sin(angle), np.cos(angle)]))
            straight = _balance(rows, -on_coupler, -on_crank)
            bent = _balance(rows, signs[1] + signs[2], signs[0] - signs[1])
            rubbed = _pull_through_pins(straight, bent, rubbing.pin)
        pull, couple = rubbed
        across = -pull[1] * (0.0 if rubbing.mirrored else 1.0)
        if torque:
            # The crank is in balance under the coupler's pull, its springs, and the couples of both its pins.
            moment = link.crank * (np.cos(angle) * pull[1] - np.sin(angle) * pull[0]) + on_crank
            effort = -moment + couple * (signs[0] - signs[1])
            dragged = (rubbing.guide.drag + rubbing.guide.friction * np.abs(across)) * np.abs(slider_rate)
        else:
            free = link.branch * (-turns[3] - pull[0])
            effort = rubbing.guide.force(free, across, 0.0, direction)
            dragged = np.abs(effort - free)
        swept = sum(np.abs(rate) for rate in (crank_rate, coupler_rate - crank_rate, coupler_rate))
        lost = {"pins": couple * swept, "guide": dragged}
    return FrictionBranch(effort, pull[0] * cosine + pull[1] * sine, across, lost)


def _speeds(assembly: Assembly, angle: FloatArray, beta: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how crank and coupler turn and the slider moves along x with the motion."""
    link = assembly.linkage
    with np.errstate(divide="ignore", invalid="ignore"):
        if assembly.drive == "torque":
            coupler = -link.crank * np.cos(angle) / (link.coupler * np.cos(beta))
            return np.ones_like(angle), coupler, -link.crank * np.sin(angle - beta) / np.cos(beta)
        knee = np.sin(angle - beta)
        crank = link.branch * np.cos(beta) / (link.crank * knee)
        coupler = -link.branch * np.cos(angle) / (link.coupler * knee)
    return crank, coupler, np.full_like(angle, -float(link.branch))


def _balance(rows: tuple[FloatArray, FloatArray], first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the pull on the coupler, (2, n), that has these moments about the pins of coupler and crank."""
    (a, b), (c, d) = rows
    size = a * d - b * c
    return np.stack([(first * d - b * second) / size, (a * second - c * first) / size])


def _pull_through_pins(straight: FloatArray, bent: FloatArray, pin: float) -> tuple[FloatArray, FloatArray]:
    """Return the pull P0 + h P1 and h = pin |P0 + h P1|; NaN where no h fits."""
    if not np.any(pin):
        return straight, np.zeros(straight.shape[1:])
    square = 1.0 - pin**2 * (bent**2).sum(axis=0)
    cross, level = pin**2 * (straight * bent).sum(axis=0), pin**2 * (straight**2).sum(axis=0)
    root = (cross + np.sqrt(cross**2 + square * level)) / square
    couple = np.where(square > 0.0, root, np.nan)
    return straight + couple * bent, couple


def _pull_of_pressed_guide(
    friction: FloatArray,
    along: FloatArray,
    direction: tuple[FloatArray, FloatArray],
    on_coupler: FloatArray,
    signs: list[FloatArray],
    assembly: Assembly,
) -> tuple[FloatArray, FloatArray]:
    """Return pull and couple where a torque drives: the guide's friction depends on which way the slider is pressed.

    NaN where it is pressed neither way: the mechanism holds itself.
    """
    sine, cosine = direction
    length = assembly.linkage.coupler
    forces = None
    for sign in (1.0, -1.0):
        # X + sign friction Y = along, and the coupler's balance about the crank pin
        rubs = 0.0 if assembly.rubbing.mirrored else sign * friction
        rows = (np.stack([np.ones_like(sine), rubs * np.ones_like(sine)]), length * np.stack([-sine, cosine]))
        straight = _balance(rows, along, -on_coupler)
        bent = _balance(rows, np.zeros_like(sine), signs[1] + signs[2])
        pull, couple = _pull_through_pins(straight, bent, assembly.rubbing.pin)
        if forces is None:
            forces = pull, couple
        else:
            is_pushed = forces[0][1] < 0.0
            # pressed neither way: the guide's friction holds the slider, and no torque moves it
            pull = np.where(is_pushed & (pull[1] > 0.0), np.nan, pull)
            forces = np.where(is_pushed, pull, forces[0]), np.where(is_pushed, couple, forces[1])
    assert forces is not None
    return forces
