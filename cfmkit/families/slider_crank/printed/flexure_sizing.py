"""Flexures for given springs and a stroke: thickness from stress, width from rate, then both corrected by the beams.

A flexure of length L in pure bending turns by psi = M L / EI, so its rate is K = EI / L = E b h^3 / (12 L) [B, eq. 12]
and its stress sigma = E h psi / (2 L). Solved for the section: h from the stress, then b from the rate.
One of finite length pushes harder, and its stress is higher where the moment is larger than on average: the beams say
by how much, and force and stress follow from width and thickness in proportion, so that a few corrections are enough.

[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.2; its Table 2 contains such a factor, 1.099.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.rounded_and_reported_values import search_values
from cfmkit.errors import InputError
from cfmkit.families.findings import mm, no_design
from cfmkit.families.rows import with_values
from cfmkit.families.slider_crank.findings import finding, unreachable
from cfmkit.families.slider_crank.linkage import unloaded_linkage
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import (
    FLEXURE_SHARE,
    chain_of_flexures,
    elasticity,
    flexures_of,
)
from cfmkit.families.slider_crank.printed.equilibrium_path import PressingEnd
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import Flexure
from cfmkit.families.slider_crank.printed.spec import Flexures, FlexureSpec
from cfmkit.families.slider_crank.unit_springs import curves_along_slider
from cfmkit.results import Design, Status
from cfmkit.specs.units import format_short
from cfmkit.stock.material_and_part_spec import sheet_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.linkage import Linkage
    from cfmkit.families.slider_crank.printed.flexures_as_beam_network import Elasticity
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


PEAK_FACTOR = 1.09
"""Largest stress of a flexure of finite length over that of pure bending, at the stroke that the stress allows:
the moment is not constant along it, and the normal force adds its part."""


def thickness_from_stress(stress: float, length: float, youngs_modulus: float, rotation: float) -> float:
    """Return the largest thickness that may be turned by `rotation` [rad]: h = 2 sigma L / (E psi) [m].

    Examples
    --------
    >>> round(thickness_from_stress(42.5e6, 10.8e-3, 1.8e9, 0.531250) * 1e3, 3)
    0.96
    """
    return 2.0 * stress * length / (youngs_modulus * rotation)


def width_from_stiffness(rate: float, length: float, youngs_modulus: float, thickness: float) -> float:
    """Return the width that gives a rate [N m/rad]: b = 12 K L / (E h^3) [m].

    Examples
    --------
    >>> round(width_from_stiffness(32.206848e-3, 10.8e-3, 1.8e9, 0.960e-3) * 1e3, 3)
    2.621
    """
    return 12.0 * rate * length / (youngs_modulus * thickness**3)


def size_flexure(rate: float, length: float, youngs_modulus: float, stress: float, rotation: float) -> Flexure:
    """Return the flexure that turns by `rotation` [rad] within `stress` [Pa] and has the rate [N m/rad].

    Its width grows with the third power of the rotation: b = 3 K E^2 psi^3 / (2 sigma^3 L^2).
    """
    thickness = thickness_from_stress(stress, length, youngs_modulus, rotation)
    return Flexure(length, thickness, width_from_stiffness(rate, length, youngs_modulus, thickness))


def rotations(linkage: Linkage, unloaded: float, travel: FloatArray, side: int = 0) -> FloatArray:
    """Return how far the three joints have turned where the slider has travelled, (3, n) [rad].

    `side`: 1 or -1, as `Linkage.side` says it; 0: that of the kink.
    """
    return curves_along_slider(linkage, unloaded, side or linkage.side(unloaded), np.asarray(travel)).turn[:3]


_MAX_ROUNDS = 8  # `configs/slider_crank_lumped.yaml` needs four; a fixed width may take four times as many
_N_POINTS = 40
_MIN_SLENDERNESS = 2.0  # length over thickness below which a flexure is none


@dataclass(frozen=True)
class SizedFlexures:
    """Flexures, and what the beams made of the closed forms."""

    flexures: tuple[Flexure, ...]  # from the ground to the slider
    force_factor: float  # force of the closed forms' flexures over that of the springs
    stress_factor: float  # their largest stress over that of pure bending
    over: float  # largest stress at last over the allowable one


@dataclass(frozen=True)
class FixedWidth:
    """Flexures of a width that stays, that of a sheet: thicknesses follow from the force, lengths from the stress."""

    shortest: tuple[float, ...]  # lengths as stated; they grow where the stress asks for it [m]
    stays: bool  # whether they do not

    def correct_sizes(self, parts: Sequence[Flexure], by_force: float, by_stress: float) -> tuple[Flexure, ...]:
        """Return flexures whose force is smaller by a factor, and whose stress is the allowable one or less.

        The force goes with h^3/L and the stress with h/L.
        """
        least = max(length / part.length for length, part in zip(self.shortest, parts, strict=True))
        longer = 1.0 if self.stays else max(least, np.sqrt(by_stress**3 / by_force))
        thicker = (longer / by_force) ** (1.0 / 3.0)
        return tuple(
            Flexure(float(part.length * longer), float(part.thickness * thicker), part.width, part.before)
            for part in parts
        )


def design_flexures(spec: SliderCrankSpec) -> Design:
    """Return the specification with flexures that have the springs' rates and bear the stroke.

    Raises InputError if springs, travel or strength are missing.
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
    stated, (linkage, unloaded) = flexures_of(spec.mechanism), unloaded_linkage(spec.mechanism)
    length = wanted.flexures.length or FLEXURE_SHARE * linkage.crank
    lengths = [length] * 3 if wanted.flexures.length or not stated else [flexure.length for flexure in stated]
    stroke = float(wanted.travel[1])
    side = spec.analysis.side_sign or linkage.side(unloaded)
    turn = np.abs(rotations(linkage, unloaded, np.array([stroke]), side)[:, 0])
    sheet, stays = sheet_of(spec.mechanism.part), wanted.flexures.length is not None
    first = (
        size_with_one_width(rates, lengths, turn, made_of)
        if sheet is None
        else size_for_width(rates, lengths, turn, made_of, sheet, stays)
    )
    stubby = next((flexure for flexure in first if flexure.length < _MIN_SLENDERNESS * flexure.thickness), None)
    if stubby is not None:
        text = f"the stress would allow a thickness of {mm(stubby.thickness)} on a length of {mm(stubby.length)}"
        cure = "make the flexures longer ('design.flexures.length'), or increase the stroke ('design.travel')"
        return unreachable(f"{text}: too stubby for a flexure; {cure}")
    travel = np.linspace(0.1 * stroke, stroke, _N_POINTS)
    springs_force = rates @ curves_along_slider(linkage, unloaded, side, travel).effort[:3]
    kept = None if sheet is None else FixedWidth(tuple(lengths), stays)
    built_in = linkage, unloaded, spec.analysis.side_sign
    sized = correct_flexures(first, made_of, built_in, travel, springs_force, wanted.flexures.exact, kept)
    if sized is None:
        return no_design(
            finding("not_converged", "the flexures of the closed forms have no equilibrium over 'design.travel'")
        )
    if sized.over > 1.0 + 1e-6 and sheet is not None:
        # the stress goes with the power -2/3 of the length
        longer = mm(1.01 * max(lengths) * sized.over**1.5)
        text = (
            f"flexures of {mm(max(lengths))} from a sheet of {mm(sheet)} have {sized.over:.4g} times the stress allowed"
        )
        return unreachable(text, {"design.flexures.length": longer})
    if (thinnest := min(min(flexure.thickness, flexure.width) for flexure in sized.flexures)) < 1.0 / PER_METRE:
        text = f"stress and force allow flexures of {mm(thinnest)} at most: less travel, or a stronger material"
        return unreachable(text)
    factors: dict[str, tuple[float | None, str, str]] = {
        "closed_form_force": (sized.force_factor, "factor", f"force {FACTOR_PHRASES[0]}"),
        "closed_form_stress": (sized.stress_factor, "factor", f"largest stress {FACTOR_PHRASES[1]}"),
    }
    return Design(
        _write_flexures(spec, sized.flexures, stroke),
        Status.COMPLETE,
        _describe_flexures(sized, wanted.flexures.exact),
        search=search_values(factors, "lumped", (0.1 * stroke, stroke)),
    )


def size_with_one_width(
    rates: FloatArray, lengths: Sequence[float], turn: FloatArray, made_of: Elasticity
) -> tuple[Flexure, ...]:
    """Return flexures of one width that have the rates [N m/rad] and bear the rotations [rad], by the closed forms.

    The flexure that needs the largest width gets it; the others are then thinner than the stress allows.
    """
    stress = (made_of.allowable_stress or np.inf) / PEAK_FACTOR
    young = made_of.youngs_modulus
    widest = max(
        size_flexure(float(rate), length, young, stress, float(psi)).width
        for rate, length, psi in zip(rates, lengths, turn, strict=True)
    )
    thickness = [
        (12.0 * rate * length / (young * widest)) ** (1.0 / 3.0) for rate, length in zip(rates, lengths, strict=True)
    ]
    return tuple(Flexure(length, float(h), widest) for length, h in zip(lengths, thickness, strict=True))


def size_for_width(
    rates: FloatArray, lengths: Sequence[float], turn: FloatArray, made_of: Elasticity, width: float, stays: bool
) -> tuple[Flexure, ...]:
    """Return flexures of a width [m] with the rates [N m/rad], by the closed forms.

    Where their stress would be too large they are longer than stated, unless their lengths stay.
    """
    stress, young = (made_of.allowable_stress or np.inf) / PEAK_FACTOR, made_of.youngs_modulus
    flexures = []
    for rate, length, psi in zip(rates, lengths, turn, strict=True):
        thickness = (12.0 * rate * length / (young * width)) ** (1.0 / 3.0)
        over = thickness / thickness_from_stress(stress, length, young, float(psi))
        # h goes with the cube root of L, so the stress with its power -2/3
        longer = 1.0 if stays else max(1.0, over**1.5)
        flexures.append(Flexure(float(length * longer), float(thickness * longer ** (1.0 / 3.0)), width))
    return tuple(flexures)


def correct_flexures(
    flexures: Sequence[Flexure],  # of the closed forms
    made_of: Elasticity,  # with the stress allowed
    # (Linkage, float, int): linkage, crank angle unloaded, and the side to which the chain bends; 0: that of its kink
    built_in: tuple[Linkage, float, int],
    # travel, force: (n,): where the force is compared, and that of the springs [m, N]
    travel: FloatArray,
    force: FloatArray,
    exact: bool,  # whether to correct; else the factors are found only
    fixed: FixedWidth | None = None,  # how, where the width stays
) -> SizedFlexures | None:
    """Return flexures whose beams have a mean force and the allowable stress; None without equilibrium."""
    parts, factors = tuple(flexures), (1.0, 1.0)
    limit, (linkage, unloaded, side) = made_of.allowable_stress or np.inf, built_in
    for number in range(_MAX_ROUNDS if fixed is None else 4 * _MAX_ROUNDS):
        pressed = chain_of_flexures(parts, made_of, linkage, unloaded).press(travel, side)
        if pressed.ending is not PressingEnd.COMPLETE:
            return None
        by_force = float(pressed.force.mean() / force.mean())
        by_stress = float(pressed.path.peak_stress().value.max() / limit)
        if number == 0:
            factors = (by_force, by_stress * PEAK_FACTOR)
        if not exact or max(abs(by_force - 1.0), abs(by_stress - 1.0)) < 1e-9:
            break
        if fixed is not None:
            before, parts = parts, fixed.correct_sizes(parts, by_force, by_stress)
            if all(abs(part.length / old.length - 1.0) < 1e-9 for part, old in zip(parts, before, strict=True)) and (
                abs(by_force - 1.0) < 1e-9
            ):
                break
            continue
        parts = tuple(
            Flexure(part.length, part.thickness / by_stress, part.width / by_force * by_stress**3, part.before)
            for part in parts
        )
    return SizedFlexures(parts, *factors, by_stress)


FACTOR_PHRASES = (
    "of flexures sized by the closed forms over that of the springs, on average",
    "of flexures sized by the closed forms over that of pure bending",
)
"""What is said of the factors of force and stress."""
PER_METRE = 1e8  # thicknesses are whole parts of it, rounded down: the stress is that of the written one


def _write_flexures(spec: SliderCrankSpec, parts: Sequence[Flexure], stroke: float) -> SliderCrankSpec:
    blocks = [
        FlexureSpec(
            length=round(part.length, 9),
            thickness=float(np.floor(part.thickness * PER_METRE) / PER_METRE),
            width=round(part.width, 8),
            before=part.before,
        )
        for part in parts
    ]
    flexures = Flexures(pivot=blocks[0], crank_pin=blocks[1], slider_pin=blocks[2])
    fidelity = None if spec.mechanism.beam is None else "lumped"
    analysis = {"analysis.travel": (0.0, stroke), "analysis.fidelity": fidelity, "analysis.drive": "force"}
    return with_values(spec, {"mechanism.flexures": flexures, **analysis})


def _describe_flexures(sized: SizedFlexures, exact: bool) -> str:
    parts = ", ".join(mm(flexure.thickness) for flexure in sized.flexures)
    done = "which the sizes are corrected for" if exact else "which the sizes are not corrected for"
    harder = format_short(sized.force_factor - 1.0, "ratio")
    return (
        f"thickness of pivot, crank pin and slider pin: {parts}, width {mm(sized.flexures[0].width)}; flexures push "
        f"{harder} harder than springs and have {sized.stress_factor:.3g} times the stress of pure bending, {done}"
    )
