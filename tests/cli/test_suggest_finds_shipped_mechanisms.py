"""Every shipped mechanism is found when its own numbers are asked for with 1 % to spare; up to a minute each."""

from __future__ import annotations

from pathlib import Path

import pytest
from suggest_support import proposal_of, propose, request_of

import cfmkit
from cfmkit.families import family
from cfmkit.metrics import window_of

CONFIGS = Path(__file__).parents[2] / "configs"
SLACK = 1.01

LARGEST_RIPPLE = 0.1
"""Above it a force varies too much to be asked for as a constant one."""


def reason_not_asked(result, space):
    """Return why the numbers of a mechanism are no request for a constant force or torque; None if they are."""
    spec, kind = result.spec, result.curve.kind
    found = cfmkit.evaluate(result)
    ripples = [one.value for key, one in found.items() if key.partition("[")[0] == f"{kind}_ripple"]
    factors = [one.value for key, one in found.items() if key.partition("[")[0].endswith("safety_factor")]
    if space is None:
        return "no box is known of it: it is measured, or moves in time"
    if result.target_curve is not None or spec.target_curve is not None:
        return "it follows a curve"
    if None in ripples or max(ripples) > LARGEST_RIPPLE:
        return f"its {kind} varies by more than {LARGEST_RIPPLE:.0%}"
    if getattr(spec.mechanism, "obstacles", None):
        return "its force is that on a workpiece"
    if min((factor for factor in factors if factor is not None), default=1.0) < 1.0 / SLACK:
        return "it is stressed above the allowable stress, which no request allows"
    return None


def solved(path, changes=()):
    """Return a shipped mechanism, analysed, and its box; leaves by their exact model, which designs are judged by."""
    spec = cfmkit.load(path, changes)
    result = cfmkit.analyze(spec.replace({"analysis.fidelity": "exact"}) if spec.family == "vcfm" else spec)
    return result, family(spec.family).envelope(result)


def ripples_of(result):
    """Return the ripples of a mechanism; of beams also those with stretch and shear, by which proposals are judged."""
    results = [result]
    if result.spec.family == "beam":
        results.append(cfmkit.analyze(result.spec.replace({"analysis.fidelity": "reissner"})))
    found = [item for solution in results for item in cfmkit.evaluate(solution).items()]
    return [one.value for key, one in found if key.partition("[")[0] == f"{result.curve.kind}_ripple"]


def numbers_of(result, space):
    """Return what a mechanism does as keys of `suggest`, each with 1 % to spare."""
    spec, kind, window = result.spec, result.curve.kind, window_of(result)
    found = cfmkit.evaluate(result)

    def values(name):
        return [one.value for key, one in found.items() if key.partition("[")[0] == name and one.value is not None]

    motion = result.curve.motion
    low, high = (window.lo, window.hi) if window else (float(motion.min()), float(motion.max()))
    means = values(f"{kind}_mean")
    factors = [*values("safety_factor"), *values("link_safety_factor")]
    sides = [one * SLACK for one in (space.across, space.along, space.depth) if one is not None]
    keys = {
        kind: f"{sum(means) / len(means)} {'N' if kind == 'force' else 'N*m'}",
        "ripple": f"{min(max(ripples_of(result)) * SLACK, 0.99)}",
        "envelope": f"[{', '.join(f'{side} m' for side in sides)}]",
        "safety": f"{max(min(factors, default=1.0) / SLACK, 1.0)}",
    }
    span = (high - low) / SLACK
    keys |= {"travel": f"{span} m"} if kind == "force" else {"angle": f"{span} rad"}
    if (material := getattr(spec.mechanism, "material", None)) is not None:
        given = material.model_dump(exclude_unset=True, mode="json")
        keys["material"] = f"[{{{', '.join(f'{name}: {value}' for name, value in given.items())}}}]"
    return spec.family, keys


@pytest.mark.long
@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.yaml")), ids=lambda path: path.stem)
def test_a_shipped_mechanism_is_found_by_its_own_numbers(path):
    """By the model of its family's designs, as the numbers are."""
    result, space = solved(path)
    if (reason := reason_not_asked(result, space)) is not None:
        pytest.skip(reason)
    assert_suggested(*numbers_of(result, space))


HALF_SIZE_OF_PETG = (
    "mechanism.crank_length=27 mm",
    "mechanism.stretched_position=50 mm",
    "mechanism.offset=30 mm",
    "mechanism.material=petg",
    "mechanism.beam={width: 2.57 mm, thickness: 0.4886 mm}",
    "analysis.travel=[0 mm, 14.5 mm]",
    "analysis.window=[0.5 mm, 14.5 mm]",
    "requirements=[]",
    "design=null",
)


@pytest.mark.slow
def test_a_strip_of_half_the_size_is_found_by_its_own_numbers():
    result, space = solved(CONFIGS / "slider_crank_strip.yaml", HALF_SIZE_OF_PETG)
    assert space.across == pytest.approx(53.7e-3, abs=1e-4)
    assert space.along == pytest.approx(80.4e-3, abs=1e-4)
    assert_suggested(*numbers_of(result, space))


def assert_suggested(name, keys):
    """Fail unless a candidate of a family does what is required by the model of its designs."""
    request = request_of(keys)
    offer, refused = propose(name, request), []
    for candidate in offer.candidates:
        proposal = proposal_of(name, candidate, request)
        if proposal.passes:
            return
        refused.append((candidate.variant, *proposal.missed, proposal.message))
    pytest.fail(f"{offer.reason} {refused}")


@pytest.mark.slow  # every configuration is analysed
def test_most_shipped_mechanisms_are_asked_for():
    asked = [path.stem for path in sorted(CONFIGS.glob("*.yaml")) if reason_not_asked(*solved(path)) is None]
    assert len(asked) >= 30
    assert {"cam", "vcfm_pla", "slider_crank_strip", "beam_design_arch", "slider_crank_tapered"} <= set(asked)
