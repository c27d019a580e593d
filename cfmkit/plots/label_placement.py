"""Labels placed beside the objects that they name, where no other line is drawn: one pass, the same result every time.

The axes are divided into cells of about half a millimetre. Every line, patch and text marks the cells it covers; a name
goes to the place near its line where it covers fewest of them, and where no other name and if possible no other line
lies between the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.plots.style import SMALL_FONT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text
    from matplotlib.transforms import Transform
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.plots.style import Look

CELL_SIZE = 1.5
"""Size of a cell [pt]: a fifth of the size of the letters, which is as near to a line as a name may come."""
LABEL_GAPS = (2.5, 6.0, 11.0, 18.0, 28.0)
"""Distances from the line that are tried [pt]: from a third of the size of the letters on, farther apart the farther
away they are, where a place need not be found as exactly."""
FINER_GAPS = (1.0, 2.5, 4.0, 6.0, 8.5, 11.0, 14.0, 18.0, 23.0, 28.0, 36.0, 46.0, 58.0, 72.0)
"""The same where every place of those covers a line, as in a narrow figure: nearer, closer together, and farther."""
COVERING_COST = 40.0
"""What it costs to cover a line over the height of a name [pt]: more than any distance that is tried."""
EDGE_MARGIN = 1.5  # least distance of a name from the edge of the axes [pt]: one cell
MIN_LEADER_DISTANCE = 9.0
"""From this distance on a thin line leads from the name to its line [pt]: more than the height of the letters, another
name could stand between them."""
N_SIGHT_PLACES = 12
"""So many places between a name and its line are looked at: over the farthest distance they are 2.5 pt apart."""
CROWDING_COST = 60.0
"""What it costs to stand at a point where the lines of other names are within a cell or two: it would name any of them.
As much as another name between the two."""
MIN_LINE_DISTANCE = 6.0  # from this distance on lines are told apart [pt]: four cells, the height of small letters
_SIDE_DIRECTIONS = np.array([[0, 1], [0, -1], [1, 0], [-1, 0], [1, 1], [-1, 1], [1, -1], [-1, -1]], dtype=float)


@dataclass(frozen=True)
class Label:
    """A name, its colour, and the points beside which it may stand."""

    # text, color: what to write, and how
    text: str
    color: str
    points: FloatArray  # (n, 2) the line that is named, in data coordinates
    prefer: float = 0.6  # where along the points the name should stand, 0 to 1
    toward: tuple[float, float] | None = None  # direction in which the name should stand from its line
    halo: bool = True  # whether to clear the background behind the name


def place_labels(
    ax: Axes,  # with everything drawn that the names must avoid
    labels: list[Label],  # in order of importance: earlier ones choose first
    size: float = SMALL_FONT,  # font size [pt]
) -> list[Text]:
    """Write names on axes whose limits are final; return the texts."""
    ground = _Ground(ax)
    lines = [ground.to_points(label.points) for label in labels]
    written = (
        _place_label(ground, label, size, [line for k, line in enumerate(lines) if k != number])
        for number, label in enumerate(labels)
    )
    return [text for text in written if text is not None]


def _place_label(ground: _Ground, label: Label, size: float, others: list[FloatArray]) -> Text | None:
    if not label.text:
        return None
    points = ground.to_points(label.points)
    points = _thin_points(points[ground.is_inside(points)])
    if not len(points):
        return None
    text = ground.ax.text(0, 0, label.text, size=size, color=label.color, ha="center", va="center", linespacing=1.15)
    box = ground.size_of(text)
    together = _find_near_other_lines(points, others)
    center, cost = _cheapest_place(ground, label, (points, together), box)
    covered = float(ground.count_covered(center[None, :], box)[0])
    if covered > 0:
        chosen, cost = label.text, cost + 2.0 * COVERING_COST * covered
        for words in (label.text, _break_in_two(label.text)):
            text.set_text(words)
            size_of_label = ground.size_of(text)
            place, price = _cheapest_place(ground, label, (points, together), size_of_label, FINER_GAPS)
            if price < cost:
                center, cost, box, chosen = place, price, size_of_label, words
        text.set_text(chosen)
    text.set_transform(ground.ax.transAxes)
    text.set_position(tuple(center / ground.extent))
    text.set_zorder(6)
    if label.halo:
        _fade_background(ground, center, box)
    gap = np.hypot(*np.maximum(np.abs(points - center) - box / 2, 0.0).T)
    anchor = points[int(np.argmin(gap))]
    if gap.min() > MIN_LEADER_DISTANCE:
        _draw_leader(ground, (center, box, anchor), label.color)
    ground.occupy(center, box + 2.0)
    return text


def _break_in_two(text: str) -> str:
    """Return a text broken at the space that is nearest to its middle; a text of one line and one word as it is.

    Examples
    --------
    >>> _break_in_two("ripple 6.86 % ≤ 6.9 %")
    'ripple 6.86 %\\n≤ 6.9 %'
    """
    # a number stays beside its unit, and behind its sign
    spaces = [
        at for at, letter in enumerate(text) if letter == " " and not (text[at - 1].isdigit() or text[at - 1] in "≤≥=")
    ]
    if not spaces or "\n" in text:
        return text
    middle = min(spaces, key=lambda at: abs(2 * at - len(text)))
    return f"{text[:middle]}\n{text[middle + 1 :]}"


def _thin_points(points: FloatArray, most: int = 80) -> FloatArray:
    return points if len(points) <= most else points[np.linspace(0, len(points) - 1, most).astype(int)]


def _find_near_other_lines(points: FloatArray, others: list[FloatArray]) -> NDArray[np.bool_]:
    """Return at which points [pt] another named line is so near that a name there would be taken for that of either."""
    is_near = np.zeros(len(points), dtype=bool)
    for line in others:
        away = points[:, None, :] - _thin_points(line, 200)[None, :, :]
        is_near |= (np.hypot(away[..., 0], away[..., 1]) < MIN_LINE_DISTANCE).any(axis=1)
    return is_near


def _cheapest_place(
    ground: _Ground,
    label: Label,
    named: tuple[FloatArray, NDArray[np.bool_]],
    box: FloatArray,
    tried: tuple[float, ...] = LABEL_GAPS,
) -> tuple[FloatArray, float]:
    """Return the cheapest centre for a box [pt] beside points, and its cost; where lines are together it costs more."""
    points, together = named
    sides, gaps = _offset_directions(tried)
    offsets, away = sides * (box / 2 + gaps), gaps.max(axis=1)
    centers = (points[:, None, :] + offsets[None, :, :]).reshape(-1, 2)
    share = np.repeat(np.linspace(0.0, 1.0, len(points)) if len(points) > 1 else [label.prefer], len(offsets))
    slanted = np.tile(np.abs(sides).sum(axis=1) > 1, len(points))
    weight = 3.0 * COVERING_COST if tried is FINER_GAPS else COVERING_COST
    cost = weight * ground.count_covered(centers, box) + 2.0 * ground.count_covered(centers, box + 5.0)
    cost = cost + np.tile(away, len(points)) + 14.0 * np.abs(share - label.prefer) + 3.0 * slanted
    if label.toward:
        wanted = np.array(label.toward) / np.hypot(*label.toward)
        unit = sides / np.hypot(sides[:, 0], sides[:, 1])[:, None]
        cost = cost + np.tile(25.0 * (1.0 - unit @ wanted), len(points))
    cost = cost + _cost_between(ground, centers, box, np.repeat(points, len(offsets), axis=0))
    cost = cost + CROWDING_COST * np.repeat(together, len(offsets))
    cost = cost + np.where(ground.holds(centers, box), 0.0, 1e6)
    cheapest = int(np.argmin(cost))
    return centers[cheapest], float(cost[cheapest])


def _offset_directions(tried: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Return on which sides of a point a name may stand (n, 2), and how far away in both directions (n, 2) [pt].

    In a narrow figure a corner of the name may also stand above or below the point, not on a diagonal alone.
    """
    away = np.array(tried)
    sides = np.repeat(_SIDE_DIRECTIONS, len(away), axis=0)
    gaps = np.tile(away, len(_SIDE_DIRECTIONS))[:, None] * [1.0, 1.0]
    if tried is not FINER_GAPS:
        return sides, gaps
    corners = np.repeat(_SIDE_DIRECTIONS[4:], len(away), axis=0)
    # a point on the edge of the axes, as where a curve begins, leaves the name its margin
    upright = np.column_stack([np.full(len(corners), FINER_GAPS[0] + EDGE_MARGIN), np.tile(away, 4)])
    return np.concatenate([sides, corners]), np.concatenate([gaps, upright])


def _cost_between(ground: _Ground, centers: FloatArray, box: FloatArray, anchors: FloatArray) -> FloatArray:
    """Return what it costs that something lies between boxes and their anchors (n, 2) [pt]."""
    starts = _nearest_box_points(centers, box, anchors)
    leaders = anchors - starts
    length = np.hypot(leaders[:, 0], leaders[:, 1])
    # the line that is named ends the way: its own cells are no obstacle
    reach = np.maximum(1.0 - 2.0 * CELL_SIZE / np.maximum(length, CELL_SIZE), 0.0)
    shares = np.linspace(0.0, 1.0, N_SIGHT_PLACES) * reach[:, None]
    places = starts[:, None, :] + shares[:, :, None] * leaders[:, None, :]
    return 15.0 * ground.any_at(places, ground.taken) + 60.0 * ground.any_at(places, ground.named)


def _nearest_box_points(centers: FloatArray, box: FloatArray, anchors: FloatArray) -> FloatArray:
    """Return the point of each box that is nearest to its anchor."""
    return np.asarray(centers + np.clip(anchors - centers, -box / 2, box / 2))


def _fade_background(ground: _Ground, center: FloatArray, box: FloatArray) -> None:
    """Draw a white, nearly opaque box behind a name, over grid and shades and below the curves."""
    from matplotlib.patches import Rectangle

    low, size = (center - box / 2 - 0.5) / ground.extent, (box + 1.0) / ground.extent
    look: Look = {"facecolor": "white", "alpha": 0.8, "linewidth": 0, "zorder": 2.1, "gid": "no-obstacle"}
    ground.ax.add_artist(Rectangle(tuple(low), *size, transform=ground.ax.transAxes, **look))


def _draw_leader(ground: _Ground, where: tuple[FloatArray, FloatArray, FloatArray], color: str) -> None:
    """Draw a thin line from the edge of a name's box to its anchor."""
    center, box, anchor = where
    ends = np.array([_nearest_box_points(center, box, anchor), anchor]) / ground.extent
    ground.ax.plot(*ends.T, transform=ground.ax.transAxes, color=color, linewidth=0.5, zorder=5, clip_on=False)


class _Ground:
    """The cells of some axes, and which of them are taken; lengths in points from the lower left corner."""

    def __init__(self, ax: Axes) -> None:
        self.ax = ax
        ax.apply_aspect()
        self.scale = 72.0 / ax.figure.dpi
        box = ax.get_window_extent()
        self.corner = np.array([box.x0, box.y0])
        self.extent = np.array([box.width, box.height]) * self.scale
        self.shape = np.maximum(np.ceil(self.extent / CELL_SIZE).astype(int), 1)
        self.taken = np.zeros(self.shape, dtype=np.int64)
        self.named = np.zeros(self.shape, dtype=np.int64)
        for line in self.ax.lines:
            if line.get_visible() and line.get_gid() != "no-obstacle":
                self._mark(self._convert_to_points(np.asarray(line.get_xydata(), dtype=float), line.get_transform()))
        for patch in self.ax.patches:
            if patch.get_gid() != "no-obstacle":
                outline = patch.get_path().to_polygons(patch.get_transform(), closed_only=False)
                for polygon in outline:
                    self._mark((np.asarray(polygon) - self.corner) * self.scale)
        for text in self.ax.texts:
            if text.get_text():
                box = text.get_window_extent()
                low = (np.array([box.x0, box.y0]) - self.corner) * self.scale
                self._fill(low, low + np.array([box.width, box.height]) * self.scale)
        self._sum_taken()

    def _convert_to_points(self, values: FloatArray, transform: Transform) -> FloatArray:
        return np.asarray((np.asarray(transform.transform(values)) - self.corner) * self.scale)

    def to_points(self, data: FloatArray) -> FloatArray:
        """Return data coordinates in points."""
        return self._convert_to_points(data, self.ax.transData)

    def size_of(self, text: Text) -> FloatArray:
        """Return the width and height of a text [pt]."""
        box = text.get_window_extent()
        return np.array([box.width, box.height]) * self.scale

    def is_inside(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return which points lie in the axes."""
        slack = 1e-6 * self.extent
        return np.asarray(np.all((points >= -slack) & (points <= self.extent + slack), axis=1))

    def _mark(self, points: FloatArray) -> None:
        """Mark the cells along a chain of points; gaps (NaN) stay open."""
        start, step = points[:-1], np.diff(points, axis=0)
        keep = np.isfinite(step).all(axis=1)
        start, step = start[keep], step[keep]
        # clip far ends first, or one long segment would take a million cells
        is_inside = (np.maximum(start, start + step) > -50) & (np.minimum(start, start + step) < self.extent + 50)
        start, step = start[is_inside.all(axis=1)], step[is_inside.all(axis=1)]
        # of a segment that leaves the axes by far, as many cells; the limit comes first, or the integer overflows
        count = np.minimum(np.ceil(np.abs(step).max(axis=1, initial=0.0) / CELL_SIZE) + 1, 2000).astype(int)
        if not len(count):
            return
        which = np.repeat(np.arange(len(count)), count)
        share = (np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)) / count[which]
        cells = np.floor((start[which] + share[:, None] * step[which]) / CELL_SIZE).astype(int)
        cells = cells[((cells >= 0) & (cells < self.shape)).all(axis=1)]
        self.taken[cells[:, 0], cells[:, 1]] = 1

    def _corners(self, low: FloatArray, high: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the first cells of boxes, and the first ones beyond them."""
        a, b = np.floor(low / CELL_SIZE).astype(int), np.ceil(high / CELL_SIZE).astype(int)
        return np.clip(a, 0, self.shape), np.clip(b, 0, self.shape)

    def _fill(self, low: FloatArray, high: FloatArray) -> None:
        """Mark a box as taken by a name."""
        a, b = self._corners(low, high)
        self.taken[a[0] : b[0], a[1] : b[1]] = self.named[a[0] : b[0], a[1] : b[1]] = 1

    def _sum_taken(self) -> None:
        self.total = np.pad(self.taken.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))

    def occupy(self, center: FloatArray, box: FloatArray) -> None:
        """Mark a box as taken by a name, for the names that follow."""
        self._fill(center - box / 2, center + box / 2)
        self._sum_taken()

    def count_covered(self, centers: FloatArray, box: FloatArray) -> FloatArray:
        """Return how many taken cells a box covers at each centre, in units of its own height."""
        (a, c), (b, d) = (corner.T for corner in self._corners(centers - box / 2, centers + box / 2))
        count = self.total[b, d] - self.total[a, d] - self.total[b, c] + self.total[a, c]
        return np.asarray(count / max(float(box[1]) / CELL_SIZE, 1.0))

    def any_at(self, places: FloatArray, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return for each row of places (n, m, 2) whether one of them lies in a marked cell."""
        at = np.clip(np.floor(places / CELL_SIZE).astype(int), 0, np.array(self.shape) - 1)
        return np.asarray(cells[at[..., 0], at[..., 1]].any(axis=1))

    def holds(self, centers: FloatArray, box: FloatArray) -> NDArray[np.bool_]:
        """Return at which centres the box lies wholly in the axes."""
        low, high = centers - box / 2, centers + box / 2
        return np.asarray(np.all((low >= EDGE_MARGIN) & (high <= self.extent - EDGE_MARGIN), axis=1))
