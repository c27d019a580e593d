"""Pictures of beam mechanisms: what is drawn is what was solved."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import CANTILEVER, MM, cantilever, config
from matplotlib.text import Text

import cfmkit
from cfmkit.families.beam.figures import centre_line, figures, rigid_parts

ARMED = CANTILEVER.replace(
    "  beams:",
    """    hand: {at: [400 mm, 30 mm]}
  links: [{master: tip, node: hand}]
  springs: {pull: {kind: line, start: hand, ground: [300 mm, 80 mm], stiffness: 1e-6 N/mm}}
  beams:""",
)


def drawn(spec, name):
    return figures(cfmkit.analyze(spec))[name]()


def by_gid(figure, start):
    return [line for ax in figure.axes for line in ax.lines if str(line.get_gid()).startswith(start)]


def test_a_beam_under_an_end_moment_is_drawn_as_a_circle():
    spec = cantilever(
        ("{kind: displacement, node: tip, direction: -90 deg}", "{kind: moment, node: tip}"),
        ("travel: 100 mm", "moment: 150 N*mm"),
    )
    path = cfmkit.analyze(spec).state.path
    line = centre_line(path, "beam", len(path) - 1)
    radius = 0.02 / 0.15
    np.testing.assert_allclose(np.hypot(line[:, 0], line[:, 1] - radius), radius, rtol=1e-6)
    turn = np.diff(np.unwrap(np.angle(np.diff(line @ np.array([1, 1j])))))
    assert np.abs(turn).max() < np.radians(3)


def test_forces_that_are_rounding_are_drawn_as_zero():
    spec = cantilever(
        ("{kind: displacement, node: tip", "{kind: force, node: tip"),
        ("travel: 100 mm", "force: 0.1 N"),
    )
    across = [line for line in drawn(spec, "reactions").axes[1].lines if len(line.get_ydata()) > 2]
    assert across
    assert all((np.asarray(line.get_ydata()) == 0).all() for line in across)


def test_links_and_springs_are_drawn_and_links_move_with_their_node():
    figure = drawn(cantilever(text=ARMED), "shapes")
    assert len(by_gid(figure, "spring-")) == 1
    poses = by_gid(figure, "pose-")
    assert len(by_gid(figure, "rigid-")) == 1 + len(poses)


def test_a_key_above_the_shapes_gives_each_pose_its_displacement_and_colour():
    figure = drawn(config("beam_lan2010", "analysis.points=9"), "shapes")
    key = [text for text in figure.findobj(Text) if text.get_text().endswith(" mm")]
    assert [text.get_text() for text in key] == ["4.5 mm", "9 mm", "13.5 mm", "18 mm"]
    poses = list(dict.fromkeys(line.get_color() for line in by_gid(figure, "pose-")))
    assert [text.get_color() for text in key] == poses
    (ax,) = figure.axes
    assert not any(text.get_window_extent().overlaps(ax.get_window_extent()) for text in key)


def test_a_link_keeps_its_length_and_turns_with_its_node():
    path = cfmkit.analyze(cantilever(text=ARMED)).state.path
    (line,) = rigid_parts(path, len(path) - 1)
    assert np.hypot(*(line[1] - line[0])) == pytest.approx(30 * MM)
    turn = path.motion("tip")[-1, 2]
    assert np.arctan2(*(line[1] - line[0])[::-1]) == pytest.approx(np.pi / 2 + turn)


def test_diagrams_say_that_beams_are_left_out():
    spec = config("beam_two_layers", "analysis.travel=4 mm", "analysis.window=[1 mm, 4 mm]", "analysis.points=9")
    for name in ("reactions", "stress"):
        reported = [text.get_text() for text in drawn(spec, name).findobj() if hasattr(text, "get_text")]
        assert any("the 6 largest of 8" in text for text in reported)


def test_forces_under_a_torque_are_those_along_x_and_y():
    spec = cantilever(
        ("{kind: displacement, node: tip, direction: -90 deg}", "{kind: rotation, node: tip}"),
        ("travel: 100 mm", "travel: 20 deg"),
        ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: roller, direction: 30 deg}"),
    )
    result = cfmkit.analyze(spec)
    panels = figures(result)["reactions"]().axes
    for ax, name, column in zip(panels, ("to the right", "upwards"), ("x", "y"), strict=True):
        (line,) = [line for line in ax.lines if len(line.get_ydata()) > 2]
        np.testing.assert_allclose(line.get_ydata(), result.curve.extra[f"beam_force_{column}"].values, atol=1e-9)
        assert ax.get_ylabel() == f"{name} [N]"


@pytest.mark.parametrize(("changes", "lines"), [((), 2), (("analysis.window=null",), 0)])
def test_the_nominal_force_of_the_paper_is_drawn_within_a_stated_window(changes, lines):
    figure = drawn(config("beam_end_effector", *changes), "curve")
    assert sum("F_d" in text.get_text() for text in figure.findobj(Text)) == lines
