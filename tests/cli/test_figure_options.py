"""Options of figures."""

from __future__ import annotations

import pytest

from cfmkit.cli.verbs.analyze import AnalyzeOptions
from cfmkit.errors import UsageError


def test_options_of_a_command_are_the_form_of_its_figures(tmp_path):
    (style_file := tmp_path / "own.mplstyle").write_text("lines.linewidth: 3")
    common = {"spec": "x.yaml", "figures": "svg", "figure_width": "84 mm", "figure_style": str(style_file)}
    form = AnalyzeOptions(**common).form
    assert (form.formats, form.width, form.titles, form.plain) == (("svg",), pytest.approx(0.084), True, False)
    assert form.settings == (("lines.linewidth", 3.0),)
    assert AnalyzeOptions(**common, plain=True).form.plain
    assert not AnalyzeOptions(**common, no_titles=True).form.titles
    with pytest.raises(UsageError, match="draws no figures and cannot be combined with --no-titles"):
        _ = AnalyzeOptions(spec="x.yaml", no_plots=True, no_titles=True).form
