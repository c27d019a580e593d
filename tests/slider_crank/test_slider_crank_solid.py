"""A printed slider-crank as drawn, as a planar solid: a strip is what beams say, flexures have links that bend."""

from __future__ import annotations

import numpy as np
import pytest
from slider_crank import config

from cfmkit import api
from cfmkit.errors import SpecError
from cfmkit.families.slider_crank.printed.outline import solved_piece
from cfmkit.families.slider_crank.printed.plane_fem_analysis import part_of
from cfmkit.results import Status

QUICK = ("analysis.fidelity=solid", "analysis.solid.poses=7", "analysis.points=41")


@pytest.fixture(scope="module")
def strip():
    """Two meshes of a strip: two seconds, the least in which its numbers can be had; and the same as a beam."""
    return {
        "solid": api.analyze(config("strip", *QUICK, "analysis.solid.error=0.1")),
        "beam": api.analyze(config("strip", "analysis.points=41")),
    }


def test_a_slender_strip_has_the_force_of_the_beam(strip):
    solid, beam = (strip[name].curve for name in ("solid", "beam"))
    assert strip["solid"].status is Status.COMPLETE
    at = np.linspace(0.1, 1.0, 10) * beam.motion[-1]
    ratio = np.interp(at, solid.motion, solid.effort) / np.interp(at, beam.motion, beam.effort)
    assert ratio == pytest.approx(np.ones(10), abs=0.006)
    assert solid.stable.all()


def test_its_stress_is_in_a_fillet_and_larger_than_the_beams(strip):
    largest = {name: float(one.curve.extra["max_stress"].values.max()) for name, one in strip.items()}
    assert 1.0 < largest["solid"] / largest["beam"] < 1.4
    (warning,) = (one for one in strip["solid"].warnings if one.name == "overstressed")
    assert "of the drawing, at" in warning.message


def test_each_fillet_of_a_strip_has_a_row_with_the_pad_that_it_is_at(strip):
    table = strip["solid"].tables["fillets"]()
    assert sorted(table["place"]) == ["ground", "ground", "slider", "slider"]
    largest = strip["solid"].curve.extra["max_stress"].values.max()
    assert 1e6 * table["max_stress"].max() == pytest.approx(largest, rel=1e-3)
    assert "fillets" not in strip["beam"].tables


def test_fillets_of_a_strip_raise_the_stress_of_the_beam_beside_them(strip):
    table = strip["solid"].tables["fillets"]()
    factor = table["stress_concentration"]
    assert ((factor > 1.1) & (factor < 1.4)).all()
    assert strip["solid"].values["stress_concentration_max"].value == factor.max()
    # half a millimetre from its end the strip has all but the stress that the beam model finds there
    largest = strip["beam"].curve.extra["max_stress"].values.max()
    assert 1e6 * table["nominal_stress"].max() == pytest.approx(largest, rel=0.05)
    assert strip["beam"].values["stress_concentration_max"].value is None


def test_the_stress_map_is_drawn_and_there_is_no_film(strip):
    assert list(api.figures(strip["solid"])) == ["curve", "stress_map"]
    assert api.figures(strip["solid"])["stress_map"]().axes


def test_the_stress_map_numbers_each_fillet_once_beside_it_as_the_table_does(strip):
    table = strip["solid"].tables["fillets"]()
    figure = api.figures(strip["solid"])["stress_map"]()
    texts = [(ax, text) for ax in figure.axes for text in ax.texts if text.get_text().isdigit()]
    assert sorted(text.get_text() for _, text in texts) == ["1", "2", "3", "4"]
    way = np.array([1e3 * strip["solid"].curve.motion[-1], 0.0])
    for ax, text in texts:
        row = int(text.get_text()) - 1
        place = np.array([table["x"][row], table["y"][row]]) - way * (table["place"][row] == "slider")
        stands = ax.transData.inverted().transform(text.get_transform().transform(text.get_position()))
        assert np.hypot(*(stands - place)) < 10.0  # mm of a part that is 125 mm long


def test_the_stress_map_is_to_scale_so_that_a_narrow_figure_does_not_squeeze_the_part(strip):
    figure = api.figures(strip["solid"])["stress_map"]()
    assert [ax.get_aspect() for ax in figure.axes][:-1] == [1.0] * (len(figure.axes) - 1)


def test_a_mirrored_pair_has_twice_the_force(strip):
    pair = api.analyze(config("strip", *QUICK, "analysis.solid.error=0.1", "mechanism.copies=mirrored"))
    assert pair.curve.effort == pytest.approx(2.0 * strip["solid"].curve.effort, rel=1e-9)


def test_corners_that_no_fillet_fits_are_known_of_the_leg_that_is_solved():
    assert solved_piece(config("strip", "mechanism.part.fillet=1 mm")).sharp == ()
    sharp = solved_piece(config("strip", "mechanism.part.fillet=10 mm")).sharp
    assert len(sharp) == 4
    assert sharp[0].startswith("no fillet of 10 mm fits the inside corner at (-4.878")


def test_flexures_are_solved_with_their_own_widths():
    part = part_of(config("lumped", "analysis.fidelity=solid"))
    assert part.width == pytest.approx(2.621e-3)
    assert [width for _, width in part.regions] == pytest.approx([2.478e-3])
    elements = part.create_mesh(0.5e-3).problem.elements
    assert set(np.round(elements.width, 9)) == {2.621e-3, 2.478e-3}


def test_printing_allowance_is_solved_but_not_drawn():
    sizes = []
    for offset in ("0 mm", "0.1 mm"):
        part = part_of(config("strip", "analysis.fidelity=solid", f"mechanism.beam.offset={offset}"))
        sizes.append(part.thinnest)
    assert sizes[1] - sizes[0] == pytest.approx(0.1e-3)


@pytest.mark.parametrize(
    ("name", "change", "reported"),
    [
        ("bilancia2019", "analysis.drive=force", "needs a part: 'mechanism.flexures' or 'mechanism.beam'"),
        ("strip", "analysis.side=before", "follows the side of its kink: remove 'analysis.side'"),
    ],
)
def test_what_is_no_part_is_refused(name, change, reported):
    with pytest.raises(SpecError, match=reported):
        config(name, "analysis.fidelity=solid", change)
