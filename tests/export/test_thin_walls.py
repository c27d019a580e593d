"""Walls of drawn parts that are thinner than their process makes."""

from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit.export.contours import circle, polygon
from cfmkit.export.thin_walls import thin_walls

MM = 1e-3
CONFIGS = Path(__file__).parents[2] / "configs"


def plate(*corners):
    return polygon([(x * MM, y * MM) for x, y in corners], "cut")


def warned(config, *changes):
    spec = cfmkit.load(CONFIGS / f"{config}.yaml", list(changes))
    return [one.message for one in cfmkit.drawing(spec).warnings if one.name == "thin_wall"]


def test_what_is_left_between_a_hole_and_an_edge_is_a_wall():
    box = plate((0, 0), (20, 0), (20, 10), (0, 10))
    hole = circle((10 * MM, 8 * MM), 1.5 * MM, "cut", hole=True)
    (wall,) = thin_walls([box, hole], 1 * MM)
    assert wall.thickness == pytest.approx(0.5 * MM, rel=0.03)
    np.testing.assert_allclose(wall.at, (10 * MM, 9.75 * MM), atol=0.2 * MM)
    assert thin_walls([box, hole], 0.49 * MM) == ()


def test_a_wall_just_as_thick_as_can_be_made_is_not_thin():
    assert thin_walls([plate((0, 0), (20, 0), (20, 1), (0, 1))], 1 * MM) == ()
    (wall,) = thin_walls([plate((0, 0), (20, 0), (20, 0.98), (0, 0.98))], 1 * MM)
    assert wall.thickness == pytest.approx(0.98 * MM)


@pytest.mark.parametrize("angle", [30.0, 45.0, 60.0, 90.0, 120.0])
def test_the_tip_of_a_corner_is_no_wall(angle):
    way = np.radians(angle)
    assert thin_walls([plate((0, 0), (20, 0), (20 * np.cos(way), 20 * np.sin(way)))], 1 * MM) == ()


def test_walls_apart_are_told_apart_with_the_thinnest_first():
    comb = plate(
        (0, 0), (20, 0), (20, 5), (15.6, 5), (15.6, 20), (15, 20), (15, 5), (5.8, 5), (5.8, 20), (5, 20), (5, 5), (0, 5)
    )
    assert [round(one.thickness / MM, 6) for one in thin_walls([comb], 1 * MM)] == [0.6, 0.8]


@pytest.mark.parametrize(
    ("config", "changes", "thick"),
    [
        ("beam_lan2010", ["frame.wall=0.7 mm"], "0.7"),
        ("vcfm_ding2022", ["frame.wall=0.4 mm"], "0.4"),
        ("vcfm_ding2022", ["frame.ground=0.6 mm"], "0.6"),
        ("slider_crank_strip", ["frame.shuttle=0.3 mm", "process.least_feature=0.5 mm"], "0.3"),
    ],
)
def test_thin_frames_of_all_families_are_warned_of(config, changes, thick):
    keys = [f"mechanism.part.{one}" for one in ("process.least_feature=0.99 mm", *changes)]
    (reported,) = warned(config, *keys)
    assert reported.startswith(f"the part is only {thick}")
    assert "mm thick at (" in reported
    assert "makes walls from" in reported


@pytest.mark.parametrize("config", ["beam_lan2010", "vcfm_ding2022", "slider_crank_strip"])
def test_parts_that_the_process_makes_are_not_warned_of(config):
    assert warned(config, "mechanism.part.process=fdm") == []
    assert warned(config) == []


def test_beams_thinner_than_the_process_makes_are_warned_of_by_the_analysis():
    spec = cfmkit.load(CONFIGS / "beam_lan2010.yaml", ["mechanism.part.process.least_feature=1.2 mm"])
    messages = [one.message for one in cfmkit.analyze(spec).warnings if one.name == "feature_small"]
    assert len(messages) == 4
    assert messages[0] == "beam b1 is 1 mm thick: less than can be made (1.2 mm)"
