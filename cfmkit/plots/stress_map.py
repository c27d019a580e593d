"""Stress on deformed parts: several poses in one colour scale, the peak marked where it is, fillets numbered."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.plots import parts
from cfmkit.plots.axis_labels_and_headings import Heading, value_text, write_heading
from cfmkit.plots.label_placement import place_labels
from cfmkit.plots.style import LINE_VERMILLION, apply_style, axes_mm, color_bar, new_figure

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.arrays import FloatArray, IntArray
    from cfmkit.plots.label_placement import Label
    from cfmkit.plots.style import Look
    from cfmkit.results import Result
    from cfmkit.solid.mesh import TriangleMesh
    from cfmkit.solid.meshed_part import MeshSolution
    from cfmkit.solid.stress_along_fillets import FilletArc

PARTS_WIDTH, HEIGHT_BESIDE, HEIGHT_ABOVE = 140.0, 110.0, 62.0
"""Room for the parts: across, and in height where they stand beside or above each other [mm]."""
VIEW_GAP = 7.0  # between views, for what stands above each [mm]
NUMBER_SIZE = 6.0  # size of the numbers of fillets [pt]
N_NEAREST_NODES = 8
"""Nodes around the middle of a fillet that tell how far it has turned: enough to lie around it on any mesh."""


@dataclass(frozen=True)
class StressView:
    """One part at one pose."""

    solved: MeshSolution
    pose: int  # number of the pose
    name: str  # what stands above it
    # fillets that are to be numbered, by their numbers in fillets.csv
    fillets: Mapping[int, FilletArc] = field(default_factory=dict)

    @property
    def moved(self) -> FloatArray:
        """Nodes where they are now (n, 2) [m]."""
        return np.asarray(
            self.solved.problem.elements.mesh.nodes + self.solved.evaluate_displacements(self._equilibrium)
        )

    @property
    def stress(self) -> FloatArray:
        """Von Mises' equivalent stress at the nodes (n,) [Pa]."""
        from cfmkit.solid.elements import equivalent

        return equivalent(self.solved.problem.elements.stress(self.solved.evaluate_displacements(self._equilibrium))[0])

    @property
    def peak(self) -> float:
        """Largest stress along a free edge [Pa]."""
        return float(self.solved.peaks[0][self.pose])

    def numbers(self, moved: FloatArray) -> Iterator[Label]:
        """Yield the numbers of fillets, to stand beside them on the side of the waste; moved: nodes (n, 2) [m]."""
        nodes = self.solved.problem.elements.mesh.nodes
        for number, arc in self.fillets.items():
            nearest = np.hypot(*(nodes - arc.middle).T).argsort()[:N_NEAREST_NODES]
            before, after = (
                (places[nearest] - places[nearest].mean(axis=0)) @ [1.0, 1.0j] for places in (nodes, moved)
            )
            turned = complex(*(arc.center - arc.middle)) * complex(np.vdot(before, after))
            yield parts.part_name(str(number), moved[nearest[0]], (turned.real, turned.imag))

    @property
    def _equilibrium(self) -> Any:
        return self.solved.course.poses[self.pose]


def stress_views(
    solved: MeshSolution, middle: int, fillets: Mapping[int, FilletArc], dimension: str
) -> list[StressView]:
    """Return a part on its way, where its stress is largest (there with its fillets), and at its last pose."""
    travel, worst = solved.course.travel, int(solved.peaks[0].argmax())
    return [
        StressView(solved, pose, value_text(float(travel[pose]), dimension), fillets if pose == worst else {})
        for pose in sorted({middle, worst, len(travel) - 1})
    ]


@apply_style
def stress_map_figure(
    result: Result,  # what the heading names
    views: Sequence[StressView],  # beside each other where the parts are tall, else above each other
    subject: str,  # what the heading says of them
) -> Figure:
    """Return a figure of parts at poses, coloured by stress in one scale, each with the place of its peak."""
    moved = [view.moved for view in views]
    low = [places.min(axis=0) for places in moved]
    sizes = np.array([np.ptp(places, axis=0) for places in moved]) * 1.05
    width, height = sizes.max(axis=0)
    beside = bool(height > width)
    room = (PARTS_WIDTH / len(views), HEIGHT_BESIDE) if beside else (PARTS_WIDTH, HEIGHT_ABOVE)
    scale = min(room[0] / width, room[1] / height)
    step = np.array([width * scale + 3.0, 0.0]) if beside else np.array([0.0, height * scale + VIEW_GAP])
    heading = Heading.from_result(result, f"{subject}; peaks marked")
    tall = (1 if beside else len(views)) * (height * scale + VIEW_GAP)
    figure = new_figure(160.0, tall + 18.0 + heading.height_mm)
    write_heading(figure, heading)
    top = max(*(view.peak for view in views), 1e-6) / 1e6
    for number, view in enumerate(views):
        x, y = np.array([10.0, 16.0]) + step * (number if beside else len(views) - 1 - number)
        ax = axes_mm(figure, (x, y, width * scale, height * scale))
        shades = _draw_part(ax, view, moved[number], top)
        ax.set_xlim(1e3 * low[number][0], 1e3 * (low[number][0] + width))
        ax.set_ylim(1e3 * low[number][1], 1e3 * (low[number][1] + height))
        ax.set_aspect("equal", anchor="SW")
        ax.set_axis_off()
        place_labels(ax, list(view.numbers(moved[number])), NUMBER_SIZE)
    bar = axes_mm(figure, (30.0, 10.0, 100.0, 3.0))
    color_bar(shades, bar, orientation="horizontal").set_label("stress [MPa]", labelpad=1)
    return figure


def boundary_nodes(mesh: TriangleMesh) -> Iterator[IntArray]:
    """Yield the nodes along each ring of a mesh, in order: a refined mesh has its halved edges after all others."""
    along = np.lexsort((mesh.arcs[:, 0], mesh.rings))
    for ring in np.unique(mesh.rings):
        yield mesh.edges[along[mesh.rings[along] == ring]][:, [0, 2]].ravel()


def _draw_part(ax: Axes, view: StressView, places: FloatArray, top: float) -> Any:
    """Draw one part [mm] with its stress, 0 ... top [MPa]; return what a colour bar is made of."""
    from matplotlib.tri import Triangulation

    grid = view.solved.problem.elements.mesh
    # each six-node triangle as four: the colour is linear in them
    small = grid.triangles[:, [0, 3, 5, 3, 1, 4, 5, 4, 2, 3, 4, 5]].reshape(-1, 3)
    places_mm = Triangulation(1e3 * places[:, 0], 1e3 * places[:, 1], small)
    shades = ax.tripcolor(places_mm, view.stress / 1e6, shading="gouraud", vmin=0.0, vmax=top, cmap="viridis", zorder=3)
    shades.set_zorder(3)
    parts.plate(ax, [places[nodes] for nodes in boundary_nodes(grid)])
    start = int(np.hypot(*(grid.nodes - view.solved.peaks[1][view.pose]).T).argmin())
    look: Look = {"marker": "o", "markersize": 6, "color": LINE_VERMILLION, "fillstyle": "none", "linestyle": ""}
    ax.plot(*(1e3 * places[start]), zorder=4, **look)
    numbers = "; fillets numbered as in fillets.csv" if view.fillets else ""
    ax.set_title(f"{view.name}: {value_text(view.peak, 'stress')}{numbers}", fontsize=7, loc="left", pad=1.0)
    return shades
