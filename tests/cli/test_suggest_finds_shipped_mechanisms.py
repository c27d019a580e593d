"""Every shipped mechanism is found when its own numbers are asked for with 1 % to spare; minutes each."""

from __future__ import annotations

from pathlib import Path

import pytest

import cfmkit
from cfmkit.families import family
from cfmkit.families.run_control import Run
from cfmkit.metrics import window_of
from cfmkit.runs.read_suggest_file import read_request
from cfmkit.studies.suggest import search

CONFIGS = Path(__file__).parents[2] / "configs"
SLACK = 1.01
SECONDS = 240.0

OTHERS = {
    "a classical problem": ("beam_cantilever", "beam_lee_frame", "beam_v_bifurcation", "beam_williams_toggle"),
    "its force follows a curve, or varies by half": (
        "beam_lan_rising", "beam_stop", "cam_balance", "cam_catalogue", "cam_linear", "cam_step", "slider_crank_li2019",
        "slider_crank_li2019_bistable", "slider_crank_li2019_from_singularity", "slider_crank_li2019_full_turn",
        "slider_crank_li2019_prototype", "slider_crank_li2019_widest", "slider_crank_rising", "vcfm_falling",
        "vcfm_straight",
    ),
    "measured or in motion: no box is known": ("cam_as_built", "cam_dynamics"),
    "it meets a workpiece": ("beam_gripper",),
}  # fmt: skip
"""Configurations that are no mechanism of constant force."""


def numbers_of(path):
    """Return what a shipped mechanism does as keys of `suggest`, each with 1 % to spare."""
    spec = cfmkit.load(path)
    result = cfmkit.analyze(spec.replace({"analysis.fidelity": "exact"}) if spec.family == "vcfm" else spec)
    kind, space, window = result.curve.kind, family(spec.family).envelope(result), window_of(result)
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
        "ripple": f"{min(max(values(f'{kind}_ripple')) * SLACK, 0.99)}",
        "envelope": f"[{', '.join(f'{side} m' for side in sides)}]",
        "safety": f"{max(min(factors, default=1.0) / SLACK, 1.0)}",
    }
    span = (high - low) / SLACK
    keys |= {"travel": f"{span} m"} if kind == "force" else {"angle": f"{span} rad"}
    if (material := getattr(spec.mechanism, "material", None)) is not None:
        given = material.model_dump(exclude_unset=True, mode="json")
        keys["material"] = f"[{{{', '.join(f'{name}: {value}' for name, value in given.items())}}}]"
    return spec.family, keys


def shipped():
    others = {name for each in OTHERS.values() for name in each}
    return [path for path in sorted(CONFIGS.glob("*.yaml")) if path.stem not in others]


@pytest.mark.long
@pytest.mark.parametrize("path", shipped(), ids=lambda path: path.stem)
def test_a_shipped_mechanism_is_found_by_its_own_numbers(path, monkeypatch):
    name, keys = numbers_of(path)
    monkeypatch.setattr(search, "names", lambda: (name,))
    found = search.suggest(read_request(None, keys).request(), Run(time_budget=SECONDS))
    assert found.listed, [one.offer.reason for one in found.answers] + [list(one) for one in found.failed.values()]
