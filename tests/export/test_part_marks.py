"""Layers of a drawing that say what stands and what is driven, in every family that is cut in one piece."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import CONFIGS
from drawing_files import write_dxf, write_svg

import cfmkit


def drawn(name, *changes):
    return cfmkit.drawing(cfmkit.load(CONFIGS / f"{name}.yaml", changes))


def middles(drawing, layer):
    """Return the middles of the extents of all contours of a layer, (n, 2) [mm], from left to right."""
    boxes = np.array([one.extents for one in drawing.contours if one.layer == layer]).reshape(-1, 4)
    return 1e3 * np.sort(0.5 * (boxes[:, :2] + boxes[:, 2:]), axis=0)


@pytest.mark.parametrize(
    ("name", "held", "driven"),
    [("beam_lan2010", 4, 3), ("vcfm_ding2022", 3, 2), ("vcfm_straight", 4, 2), ("vcfm_u_shape", 3, 2),
     ("slider_crank_strip", 1, 1), ("slider_crank_lumped", 1, 1)],
)  # fmt: skip
def test_what_stands_and_what_moves_is_on_layers_of_its_own(name, held, driven):
    drawing = drawn(name)
    assert (len(middles(drawing, "held")), len(middles(drawing, "driven"))) == (held, driven)


@pytest.mark.parametrize("name", ["vcfm_ding2022", "vcfm_straight", "vcfm_u_shape", "slider_crank_strip"])
def test_marks_lie_on_the_part_and_change_nothing_of_it(name):
    from shapely import Polygon

    drawing = drawn(name)
    solid = Polygon()
    for one in drawing.contours:
        if one.layer == "cut":
            own = Polygon(one.points(1e-6))
            solid = solid.difference(own) if one.hole else solid.union(own)
    for one in drawing.contours:
        if one.layer in ("held", "driven"):
            block = Polygon(one.points(1e-6))
            assert block.difference(solid).area < 0.01 * block.area


def test_marks_of_a_mirrored_part_are_mirrored():
    held = middles(drawn("beam_lan2010"), "held")
    assert held[:, 0] == pytest.approx(-held[::-1, 0], abs=1e-9)


def test_files_have_the_layers_and_solids_do_not_see_them(tmp_path):
    import ezdxf

    drawing = drawn("slider_crank_strip")
    path = tmp_path / "part.dxf"
    path.write_bytes(write_dxf(drawing))
    layers = {one.dxf.layer for one in ezdxf.readfile(path).modelspace()}
    assert {"cut", "held", "driven"} <= layers
    assert b'id="held"' in write_svg(drawing)


@pytest.mark.parametrize(
    ("name", "changes", "texts"),
    [("beam_lan2010", ["mechanism.part.frame.ground=6 mm"], ["lan-2010, sheet 10 mm"]),
     ("vcfm_ding2022", [], ["ding-2022, sheet 10 mm", "ding-2022, sheet 6 mm"]),
     ("slider_crank_lumped", ["name=x"], ["x, sheet 2.621 mm"])],
)  # fmt: skip
def test_name_and_thickness_of_the_sheet_are_engraved_on_what_is_held(tmp_path, name, changes, texts):
    import ezdxf
    from shapely import Point, Polygon

    from cfmkit.export import files

    drawing = drawn(name, *changes)
    made = files(drawing, kerf=1e-4, formats=("dxf", "svg"))
    for stem in (f"{drawing.name}.dxf", f"{drawing.name}-kerf.dxf"):
        path = tmp_path / stem
        path.write_bytes(made[stem])
        read = [one for one in ezdxf.readfile(path).modelspace() if one.dxftype() == "TEXT"]
        assert sorted(one.dxf.text for one in read) == texts
        assert {one.dxf.layer for one in read} == {"engraved"}
    held = [Polygon(one.points(1e-6)) for one in drawing.contours if one.layer == "held"]
    for one in read:
        assert any(
            shape.contains(Point(1e-3 * one.dxf.align_point[0], 1e-3 * one.dxf.align_point[1])) for shape in held
        )
    for text in texts:
        assert text.encode() in made[f"{drawing.name}.svg"]
    assert b'id="engraved"' in made[f"{drawing.name}.svg"]


def test_what_is_engraved_is_text_in_a_drawing_whatever_its_signs():
    from dataclasses import replace
    from xml.etree import ElementTree

    drawing = drawn("slider_crank_strip")
    odd = replace(drawing, labels=tuple(replace(one, text="a<b & c") for one in drawing.labels))
    tree = ElementTree.fromstring(write_svg(odd))
    assert [one.text for one in tree.iter("{http://www.w3.org/2000/svg}text")] == ["a<b & c"]
