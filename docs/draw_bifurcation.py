"""Draw the bifurcation diagram of docs/beam.md: python docs/draw_bifurcation.py [FILE.png].

From configs/beam_v_bifurcation.yaml: the symmetric path, before the pitchfork and through it, and both branches that
leave it. Stable equilibria are full lines, unstable ones dashed, bifurcations dots.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import cfmkit
from cfmkit.plots.style import LINE_BLUE, LINE_VERMILLION, TEXT_GREY, TEXT_INK, apply_style, axes_mm, new_figure, png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parent
BRANCHES = (
    ("one side", LINE_BLUE, "analysis.other_side=false"),
    ("its mirror image", LINE_VERMILLION, "analysis.other_side=true"),
)


def solved(*changes: str) -> cfmkit.Result:
    """Return the analysis of the shipped specification with changes."""
    return cfmkit.analyze(
        cfmkit.load(ROOT.parent / "configs" / "beam_v_bifurcation.yaml", ("analysis.modes=0", *changes))
    )


def _parts(mask: Any) -> list[slice]:
    """Return the runs of true values, each with one point more on both sides, so that lines meet."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return [slice(max(a - 1, 0), b + 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _draw(ax: Axes, curve: Any, values: Any, mask: Any, color: str) -> None:
    """Draw the points that a mask selects, stable and unstable ones apart."""
    for stable, look in ((True, "-"), (False, "--")):
        for part in _parts(mask & (curve.stable == stable)):
            ax.plot(1e3 * curve.motion[part], values[part], look, color=color, linewidth=1.5)


@apply_style
def diagram(*changes: str) -> Figure:
    """Return the diagram: rotation of the eye and force, over the displacement."""
    primary = solved("analysis.branch=primary", *changes)
    figure = new_figure(160.0, 118.0)
    upper = axes_mm(figure, (16.0, 64.0, 140.0, 50.0))
    lower = axes_mm(figure, (16.0, 11.0, 140.0, 46.0))
    axes = ((upper, "eye_rotation", np.degrees(1.0)), (lower, "", 1.0))

    def values(result: cfmkit.Result, name: str, unit: float) -> Any:
        return unit * (result.curve.extra[name].values if name else result.curve.force)

    for ax, name, unit in axes:
        _draw(ax, primary.curve, values(primary, name, unit), np.ones(len(primary.curve), dtype=bool), TEXT_INK)
    for label, color, change in BRANCHES:
        branch = solved(change, *changes)
        for ax, name, unit in axes:
            off = np.array([path != "primary" for path in branch.curve.extra["path"].values])
            _draw(ax, branch.curve, values(branch, name, unit), off, color)
        turn = np.degrees(branch.curve.extra["eye_rotation"].values)
        peak = int(np.abs(turn).argmax())
        place, sense = (1e3 * branch.curve.motion[peak], turn[peak]), np.sign(turn[peak])
        upper.annotate(
            label, place, (0, -10 * sense), textcoords="offset points", color=color, ha="center", va="center"
        )
    places = np.array([event.drive for event in primary.state.path.events if event.kind == "bifurcation"])
    for ax, name, unit in axes:
        height = np.interp(places, primary.curve.motion, values(primary, name, unit))
        ax.plot(1e3 * places, height, "o", color=TEXT_INK, markersize=4)
    upper.annotate(
        "symmetric, dashed where unstable", (3.3, 0.0), (0, 5), textcoords="offset points", color=TEXT_INK, ha="center"
    )
    lower.annotate("symmetric", (2.3, 4.6), (0, 4), textcoords="offset points", color=TEXT_INK, ha="center")
    lower.annotate("both branches", (1.2, 1.1), color=TEXT_GREY, ha="left", va="center")
    upper.set_ylabel("rotation of the eye [deg]")
    upper.tick_params(labelbottom=False)
    lower.set_ylabel("force [N]")
    lower.set_xlabel("displacement [mm]")
    return figure


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "images" / "beam_bifurcation.png"
    target.write_bytes(png(diagram()))
