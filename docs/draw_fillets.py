"""Draw the trade of fillets of docs/solid.md: python docs/draw_fillets.py [FILE.png].

The mechanism of Lan as a solid with fillets of several radii: its mean force rises with them; the largest stress falls
up to some 1 mm, then it stays within its error bars. Takes minutes; prints the rows of the table, too.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import cfmkit
from cfmkit.plots.style import LINE_BLUE, LINE_VERMILLION, apply_style, axes_mm, new_figure, png

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parent
RADII = (0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.0)
"""Of the fillets [mm]."""


def solved(radius: float) -> tuple[float, float, float]:
    """Return mean force [N], largest stress [MPa] and its error as a share, with fillets of a radius [mm]."""
    changes = ["analysis.fidelity=solid", f"mechanism.part={{fillet: {radius} mm}}"]
    result = cfmkit.analyze(cfmkit.load(ROOT.parent / "configs" / "beam_lan2010.yaml", changes))
    metrics = cfmkit.evaluate(result)
    error = float(result.values["mesh_stress_error"].value or 0.0)
    return float(metrics["force_mean"].value), 1e-6 * float(metrics["stress_max"].value), error


@apply_style
def trade(rows: list[tuple[float, float, float]]) -> Figure:
    """Return the figure: mean force and largest stress over the radius of the fillets."""
    figure = new_figure(160.0, 74.0)
    force = axes_mm(figure, (16.0, 12.0, 56.0, 56.0))
    stress = axes_mm(figure, (98.0, 12.0, 56.0, 56.0))
    means, peaks, errors = zip(*rows, strict=True)
    force.plot(RADII, means, "o-", color=LINE_BLUE, linewidth=1.5, markersize=4)
    bars = [share * peak for share, peak in zip(errors, peaks, strict=True)]
    stress.errorbar(RADII, peaks, bars, fmt="o-", color=LINE_VERMILLION, linewidth=1.5, markersize=4, capsize=2)
    force.set_ylabel("mean force, 7 ... 13.6 mm [N]")
    stress.set_ylabel("largest stress [MPa]")
    for ax in (force, stress):
        ax.set_xlabel("fillets [mm]")
        ax.set_xlim(0.0, None)
    stress.set_ylim(0.0, None)
    return figure


if __name__ == "__main__":
    found = [solved(radius) for radius in RADII]
    for radius, (mean, peak, error) in zip(RADII, found, strict=True):
        print(f"| {radius:g} mm | {mean:.3f} N | {peak:.1f} MPa | {100 * error:.1f} % |", flush=True)
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "images" / "solid_fillets.png"
    target.write_bytes(png(trade(found)))
