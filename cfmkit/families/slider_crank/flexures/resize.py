"""Flexures for given springs and a stroke: thickness from stress, width from rate, then both corrected by the beams.

The closed forms take a flexure for a spring in pure bending. One of finite length pushes harder, and its stress
is higher where the moment is larger than on average: the beams say by how much, and force and stress follow from
width and thickness in proportion, so that a few corrections are enough.

Reference
---------
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.2; its Table 2 contains such a factor, 1.099.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import InputError
from cfmkit.families.findings import mm
from cfmkit.families.refusals import no_design
from cfmkit.families.slider_crank.build import side_of
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.flexures.assembly import FLEXURE_SHARE, chain_of_flexures, elasticity, flexures_of
from cfmkit.families.slider_crank.flexures.pressing import Ending
from cfmkit.families.slider_crank.flexures.sizing import PEAK_FACTOR, Flexure, rotations, sized
from cfmkit.families.slider_crank.flexures.spec import Flexures, FlexureSpec
from cfmkit.families.slider_crank.unit_springs import along_slider
from cfmkit.results import Design, Quantity, Searched, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.flexures.chain import Elasticity
    from cfmkit.families.slider_crank.linkage import Linkage
    from cfmkit.families.slider_crank.spec import SliderCrankSpec

_ROUNDS = 8
_POINTS = 40
_SLENDER = 2.0  # length over thickness below which a flexure is none


@dataclass(frozen=True)
class Sized:
    """Flexures, and what the beams made of the closed forms.

    Attributes
    ----------
    flexures : tuple of Flexure
        From the ground to the slider.
    force_factor : float
        Force of the closed forms' flexures over that of the springs.
    stress_factor : float
        Their largest stress over that of pure bending.
    """

    flexures: tuple[Flexure, ...]
    force_factor: float
    stress_factor: float


def design_flexures(spec: SliderCrankSpec, linkage: Linkage, unloaded: float) -> Design:
    """Return the specification with flexures that have the springs' rates and bear the stroke.

    Raises
    ------
    cfmkit.errors.InputError
        If springs, travel or strength are missing.
    """
    wanted = spec.design
    assert wanted is not None
    assert wanted.flexures is not None
    springs, made_of = spec.mechanism.springs, elasticity(spec.mechanism)
    rates = np.array([springs.pivot, springs.crank_pin, springs.slider_pin])
    if not (rates > 0).all() or wanted.travel is None or made_of.allowable_stress is None:
        raise InputError(
            "flexures are sized for the rates of 'pivot', 'crank_pin' and 'slider_pin' in 'mechanism.springs', "
            "'design.travel' and the 'yield_strength' of 'mechanism.material'"
        )
    own = flexures_of(spec.mechanism)
    length = wanted.flexures.length or FLEXURE_SHARE * linkage.crank
    lengths = [length] * 3 if wanted.flexures.length or not own else [one.length for one in own]
    stroke = float(wanted.travel[1])
    side = side_of(spec, linkage, unloaded)
    turn = np.abs(rotations(linkage, unloaded, np.array([stroke]))[:, 0])
    first = one_width(rates, lengths, turn, made_of)
    stubby = next((one for one in first if one.length < _SLENDER * one.thickness), None)
    if stubby is not None:
        text = f"the stress would allow a thickness of {mm(stubby.thickness)} on a length of {mm(stubby.length)}"
        cure = "make them longer ('design.flexures.length'), or the stroke larger ('design.travel')"
        return no_design(finding("target_unreachable", f"{text}: no flexure; {cure}"))
    travel = np.linspace(0.1 * stroke, stroke, _POINTS)
    springs_force = rates @ along_slider(linkage, unloaded, side, travel).effort[:3]
    found = corrected(first, made_of, (linkage, unloaded), travel, springs_force, wanted.flexures.exact)
    if found is None:
        return no_design(
            finding("not_converged", "the flexures of the closed forms have no equilibrium over 'design.travel'")
        )
    over = (
        "over that of the springs, on average, of flexures by the closed forms",
        "over that of pure bending, of those",
    )
    factors = {
        "closed_form_force": Quantity(found.force_factor, "factor", f"force {over[0]}"),
        "closed_form_stress": Quantity(found.stress_factor, "factor", f"largest stress {over[1]}"),
    }
    return Design(
        _written(spec, found.flexures, stroke),
        Status.COMPLETE,
        _message(found, wanted.flexures.exact),
        search={name: Searched(item, "lumped", (0.1 * stroke, stroke)) for name, item in factors.items()},
    )


def one_width(
    rates: FloatArray, lengths: Sequence[float], turn: FloatArray, made_of: Elasticity
) -> tuple[Flexure, ...]:
    """Return flexures of one width that have the rates [N m/rad] and bear the rotations [rad], by the closed forms.

    The flexure that needs the largest width gets it; the others are then thinner than the stress allows.
    """
    stress = (made_of.allowable_stress or np.inf) / PEAK_FACTOR
    young = made_of.youngs_modulus
    widest = max(
        sized(float(rate), length, young, stress, float(psi)).width
        for rate, length, psi in zip(rates, lengths, turn, strict=True)
    )
    thickness = [
        (12.0 * rate * length / (young * widest)) ** (1.0 / 3.0) for rate, length in zip(rates, lengths, strict=True)
    ]
    return tuple(Flexure(length, float(h), widest) for length, h in zip(lengths, thickness, strict=True))


def corrected(
    flexures: Sequence[Flexure],
    made_of: Elasticity,
    built_in: tuple[Linkage, float],
    travel: FloatArray,
    force: FloatArray,
    exact: bool,
) -> Sized | None:
    """Return flexures whose beams have a mean force and the allowable stress; None without equilibrium.

    Parameters
    ----------
    flexures : sequence of Flexure
        Of the closed forms.
    made_of : Elasticity
        With the stress allowed.
    built_in : (Linkage, float)
        Linkage and crank angle unloaded.
    travel, force : (n,) arrays
        Where the force is compared, and that of the springs [m, N].
    exact : bool
        Whether to correct; else the factors are found only.
    """
    parts, factors = tuple(flexures), (1.0, 1.0)
    limit = made_of.allowable_stress or np.inf
    for number in range(_ROUNDS):
        pressed = chain_of_flexures(parts, made_of, *built_in).press(travel)
        if pressed.ending is not Ending.COMPLETE:
            return None
        by_force = float(pressed.force.mean() / force.mean())
        by_stress = float(pressed.path.peak_stress().value.max() / limit)
        if number == 0:
            factors = (by_force, by_stress * PEAK_FACTOR)
        if not exact or max(abs(by_force - 1.0), abs(by_stress - 1.0)) < 1e-9:
            break
        parts = tuple(
            Flexure(one.length, one.thickness / by_stress, one.width / by_force * by_stress**3, one.before)
            for one in parts
        )
    return Sized(parts, *factors)


def _written(spec: SliderCrankSpec, parts: Sequence[Flexure], stroke: float) -> SliderCrankSpec:
    blocks = [
        FlexureSpec(
            length=one.length,
            thickness=float(np.floor(one.thickness * 1e8) / 1e8),
            width=round(one.width, 8),
            before=one.before,
        )
        for one in parts
    ]
    flexures = Flexures(pivot=blocks[0], crank_pin=blocks[1], slider_pin=blocks[2])
    mechanism = spec.mechanism.model_copy(update={"flexures": flexures})
    changes = {"travel": (0.0, stroke), "fidelity": None if mechanism.beam is None else "lumped", "drive": "force"}
    analysis = spec.analysis.model_copy(update=changes)
    return spec.model_copy(update={"mechanism": mechanism, "analysis": analysis})


def _message(found: Sized, exact: bool) -> str:
    parts = ", ".join(mm(one.thickness) for one in found.flexures)
    done = "corrected for it" if exact else "not corrected for it"
    harder = format_short(found.force_factor - 1.0, "ratio")
    return (
        f"thickness of pivot, crank pin and slider pin: {parts}, width {mm(found.flexures[0].width)}; flexures push "
        f"{harder} harder than springs and have {found.stress_factor:.3g} times the stress of pure bending, {done}"
    )
