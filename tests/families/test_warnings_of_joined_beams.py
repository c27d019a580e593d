"""What a drawing joins although the mechanism has it apart is found, and named with its place."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import cfmkit
from cfmkit import api
from cfmkit.cli import run_command
from cfmkit.errors import GeometryError

CONFIGS = Path(__file__).parents[2] / "configs"
GUIDED = {"support": "guided", "direction": "90 deg"}


def spec(nodes: dict[str, Any], beams: dict[str, Any], **mechanism: Any) -> Any:
    """Return beams of 1 mm between nodes in mm; a node is [x, y] and its support, where it has one."""
    described = {
        name: {"at": [f"{x} mm", f"{y} mm"]} | (about if isinstance(about, dict) else {"support": about})
        for name, (x, y, about) in nodes.items()
    }
    ends = {name: ({"start": one[0], "end": one[1]} | (one[2] if len(one) > 2 else {})) for name, one in beams.items()}
    return cfmkit.loads(
        json.dumps(
            {
                "cfmkit": 1,
                "family": "beam",
                "name": "own",
                "mechanism": {
                    "material": {"youngs_modulus": "2 GPa", "poisson_ratio": 0.35},
                    "thickness": "1 mm",
                    "width": "3 mm",
                    "axial": True,
                    "nodes": described,
                    "beams": ends,
                    "drive": {"kind": "displacement", "node": "n", "direction": "-90 deg"},
                    **mechanism,
                },
                "analysis": {"travel": "0.2 mm", "points": 5, "solid": {"poses": 3, "error": "20 %"}},
            }
        )
    )


TWO_PARALLEL = {"a": (0, 0, "clamped"), "b": (0, 1.2, "clamped"), "n": (60, 0, GUIDED), "m": (60, 1.2, "free")}
LINKED = {"links": [{"master": "n", "node": "m"}]}
FROM_A = {"b1": ("a", "n")}

JOINED = {
    "crossing": (
        spec(
            {"a": (0, 0, "clamped"), "b": (0, 20, "clamped"), "n": (60, 20, GUIDED), "m": (60, 0, "free")},
            {"b1": ("a", "n"), "b2": ("b", "m")},
            **LINKED,
        ),
        "b1 and b2 at (30",
    ),
    "filled by fillets": (
        spec(TWO_PARALLEL, {"b1": ("a", "n"), "b2": ("b", "m")}, **LINKED),
        "where fillets fill the gap of 0.2 mm",
    ),
    "a tip on a beam": (
        spec(
            {"a": (0, 0, "clamped"), "n": (60, 0, GUIDED), "c": (30, 25, "clamped"), "t": (30, 0.8, "free")},
            {"b1": ("a", "n"), "b2": ("c", "t")},
        ),
        "b1 and b2 at (29.88 mm, 0.4 mm)",
    ),
    "a beam through another's pad": (
        spec(
            {"a": (0, 0, "clamped"), "c": (30, 2, "clamped"), "q": (30, 30, "free"), "n": (60, 0, GUIDED)},
            {"b1": ("a", "n"), "b2": ("c", "q"), "b3": ("q", "n")},
        ),
        "b1 and the pad of b2 at c at (28.26 mm, 0 mm)",
    ),
    "a beam and its image": (
        spec({"a": (-10, 0, "clamped"), "n": (20, 30, GUIDED)}, FROM_A, copies={"mirror": ["0 mm", "0 mm"]}),
        "b1 and b1' at (0 mm",
    ),
    "a loop": (
        spec(
            {"a": (0, 0, "clamped"), "n": (40, 10, GUIDED)},
            {
                "b1": (
                    "a",
                    "n",
                    {"shape": {"kind": "polynomial", "coefficients": ["0 rad", "8 rad"], "length": "80 mm"}},
                )
            },
        ),
        "b1 with itself",
    ),
    "a very pointed node": (
        spec(
            {"a": (0, 0, "clamped"), "b": (0, 6, "clamped"), "n": (50, 3, GUIDED)}, {"b1": ("a", "n"), "b2": ("b", "n")}
        ),
        "b1 and b2 at (4",
    ),
}


@pytest.mark.parametrize("name", JOINED)
def test_what_the_outline_joins_away_from_nodes_is_told_with_names_and_place(name):
    mechanism, told = JOINED[name]
    (warning,) = api.drawing(mechanism).warnings
    assert warning.name == "joined_away_from_nodes"
    assert told in warning.message
    assert "\n" not in warning.message


APART = {
    "parallel, with room for the cutter": spec(
        TWO_PARALLEL | {"b": (0, 2.2, "clamped"), "m": (60, 2.2, "free")},
        {"b1": ("a", "n"), "b2": ("b", "m")},
        **LINKED,
    ),
    "without fillets, a hair apart": spec(
        TWO_PARALLEL, {"b1": ("a", "n"), "b2": ("b", "m")}, part={"fillet": 0, "pad": ["4 mm", "1 mm"]}, **LINKED
    ),
    "a node of 25 degrees": spec(
        {"a": (0, 0, "clamped"), "b": (0, 22, "clamped"), "n": (50, 11, GUIDED)}, {"b1": ("a", "n"), "b2": ("b", "n")}
    ),
    "a short beam between two nodes": spec(
        {"a": (0, 0, "clamped"), "e": (40, 0, "free"), "f": (40, 2, "free"), "n": (0, 20, GUIDED)},
        {"b1": ("a", "e"), "b2": ("e", "f"), "b3": ("f", "n")},
    ),
}


@pytest.mark.parametrize("name", APART)
def test_what_is_meant_to_be_joined_is_not_told(name):
    assert api.drawing(APART[name]).warnings == ()


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("beam_*.yaml")), ids=lambda path: path.stem)
def test_no_part_of_the_package_is_joined_unasked(path):
    assert api.drawing(cfmkit.load(path)).warnings == ()


def test_beams_that_lie_on_each_other_bend_as_one_and_the_solid_says_so():
    """Twice as thick, eight times as stiff: four times both; 5 % for the pads' sides, a coarse mesh and shear."""
    lying = TWO_PARALLEL | {"b": (0, 1.0, "clamped"), "m": (60, 1.0, "free")}
    mechanism = spec(lying, {"b1": ("a", "n"), "b2": ("b", "m")}, part={"fillet": 0}, **LINKED)
    beams, solid = (cfmkit.analyze(mechanism.replace({"analysis.fidelity": one})) for one in ("extensible", "solid"))
    assert solid.curve.effort[-1] / beams.curve.effort[-1] == pytest.approx(4.0, rel=0.05)
    assert "joined_away_from_nodes" in {one.name for one in solid.warnings}


def test_export_prints_the_warning_and_has_it_in_its_document(tmp_path, capsys):
    (tmp_path / "own.yaml").write_text(api.dumps(JOINED["crossing"][0]))
    assert run_command(["export", str(tmp_path / "own.yaml"), "-o", str(tmp_path / "out")]) == 0
    assert "joined_away_from_nodes: drawn as one piece" in capsys.readouterr().out
    assert run_command(["export", str(tmp_path / "own.yaml"), "-o", str(tmp_path / "out"), "--json"]) == 0
    (warning,) = json.loads(capsys.readouterr().out)["warnings"]
    assert warning["name"] == "joined_away_from_nodes"


def test_a_pin_that_the_outline_does_not_have_is_told():
    nodes = {"a": (0, 0, "clamped"), "e": (30, 0, "free"), "n": (60, 5, GUIDED)}
    (warning,) = api.drawing(spec(nodes, {"b1": ("a", "e"), "b2": ("e", "n", {"start_joint": "pin"})})).warnings
    assert warning.name == "pins_not_drawn"
    assert "b2 at e" in warning.message


def test_leaves_of_neighbouring_vs_that_overlap_are_refused():
    mechanism = cfmkit.load(CONFIGS / "vcfm_ding2022.yaml")
    with pytest.raises(GeometryError, match=r"overlap, at .*touch at 1.008 mm.*mechanism\.frame\.spacing"):
        api.drawing(mechanism.replace({"mechanism.frame.spacing": "1 mm"}))
    assert api.drawing(mechanism.replace({"mechanism.frame.spacing": "1.02 mm"})).contours


def test_a_leg_that_crosses_itself_is_not_hidden_by_its_frame():
    mechanism = cfmkit.load(CONFIGS / "slider_crank_strip.yaml").replace(
        {
            "mechanism.crank_length": "12 mm", "mechanism.stretched_position": "40 mm", "mechanism.offset": "0 mm",
            "mechanism.unloaded_angle": "2.8 rad", "analysis.travel": ["0 mm", "2 mm"],
            "analysis.window": ["1 mm", "2 mm"], "mechanism.part": {"frame": {"ground": "5 mm"}},
        }
    )  # fmt: skip
    with pytest.raises(GeometryError, match=r"the outline encloses .* beams may lie on each other"):
        api.drawing(mechanism)
