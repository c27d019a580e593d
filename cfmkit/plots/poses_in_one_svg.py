"""A mechanism in motion, as one SVG: what never moves stands in it once, what moves once for every pose.

The families draw a pose on axes as they do for their figures; what two poses have in common is found by comparing
what is drawn. So a page needs no drawing code of its own, and a script has nothing to do but to show one pose.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from cfmkit.plots.style import apply_style, axes_mm, new_figure
from cfmkit.plots.vector_formats import inline, svg

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from matplotlib.axes import Axes

    from cfmkit.arrays import FloatArray

N_FILM_POSES = 17
"""Poses of a film: every sixteenth of the travel, which the eye joins; with 25 a cam's page took 1.6 times as long as
its figures, and half as long again is what a page may cost."""
MAX_DRAWING_WIDTH, MAX_DRAWING_HEIGHT = 150.0, 110.0  # largest width and height of the drawing [mm of print]
_SVG_NAMESPACE, _XLINK_NAMESPACE = "http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"
_SVG_TAG = f"{{{_SVG_NAMESPACE}}}"


@dataclass(frozen=True)
class Moving:
    """Mechanism in motion, as its family draws it."""

    motion: FloatArray  # (n,) displacement [m] or angle [rad] of each pose, as the curve has it
    box: tuple[float, float, float, float]  # left, bottom, right and top of what all poses need [m]
    draw: Callable[[Axes, int], Any]  # ``draw(ax, number)`` draws one pose to scale
    # the same where `draw` has symbols that are not to scale: with the size of every part that takes room
    draw_as_made: Callable[[Axes, int], Any] | None = None


def choose_poses(count: int, poses: int = N_FILM_POSES) -> FloatArray:
    """Return which of so many points of a curve are shown as poses: evenly, the ends included."""
    return np.unique(np.linspace(0, count - 1, min(count, poses)).round().astype(int))


def film(
    moving: Moving,  # what to draw
    title: str,  # what a screen reader says about it
) -> str:
    """Return all poses as one SVG for a page: each in groups of the class ``pose`` with its number in ``data-pose``."""
    return _merge_poses(poses(moving, range(len(moving.motion))), title)


def still(moving: Moving, number: int, title: str) -> str:
    """Return one pose as SVG for a page."""
    return _merge_poses(poses(moving, (number,)), title)


@apply_style
def poses(moving: Moving, numbers: Iterable[int]) -> list[ElementTree.Element]:
    """Return poses as SVG, all drawn on the same axes: to make axes takes as long as to draw on them."""
    left, bottom, right, top = moving.box
    scale = min(MAX_DRAWING_WIDTH / (right - left), MAX_DRAWING_HEIGHT / (top - bottom))
    figure = new_figure((right - left) * scale, (top - bottom) * scale)
    ax = axes_mm(figure, (0.0, 0.0, (right - left) * scale, (top - bottom) * scale))
    ax.set_axis_off()
    own = set(ax.get_children())
    drawn = []
    for number in numbers:
        moving.draw(ax, number)
        drawn.append(ElementTree.fromstring(inline(svg(figure), "film")))
        for artist in set(ax.get_children()) - own:
            artist.remove()
    return drawn


def _merge_poses(poses: Sequence[ElementTree.Element], title: str) -> str:
    """Return poses as one: runs of what differs between pieces that all of them have, in the order of drawing."""
    ElementTree.register_namespace("", _SVG_NAMESPACE)
    ElementTree.register_namespace("xlink", _XLINK_NAMESPACE)
    each = [[_plain(element) for element in _pieces(pose)] for pose in poses]
    common = _common(each)
    body: list[str] = []
    at = [0] * len(each)
    for anchor in [*common, None]:
        runs = []
        for number, pieces in enumerate(each):
            end = pieces.index(anchor, at[number]) if anchor is not None else len(pieces)
            runs.append(pieces[at[number] : end])
            at[number] = end + 1
        body += [f'<g class="pose" data-pose="{number}">{"".join(run)}</g>' for number, run in enumerate(runs) if run]
        body += [] if anchor is None else [anchor]
    shared: dict[str, str] = {}
    for pose in poses:
        shared |= {piece.get("id", ""): _plain(piece) for piece in pose.iter() if _is_shared(piece)}
    box = poses[0].get("viewBox", "")
    return (
        f'<svg xmlns="{_SVG_NAMESPACE}" xmlns:xlink="{_XLINK_NAMESPACE}" viewBox="{box}" role="img" '
        f"aria-label={quoteattr(title)}>"
        f"<defs>{''.join(shared.values())}</defs>{''.join(body)}</svg>"
    )


def _pieces(pose: ElementTree.Element) -> list[ElementTree.Element]:
    """Return what is drawn, in order: paths, uses and texts that stand in no definition."""
    hidden = {id(inner) for block in pose.iter(f"{_SVG_TAG}defs") for inner in block.iter()}
    drawn = {f"{_SVG_TAG}{kind}" for kind in ("path", "use", "text", "image")}
    return [element for element in pose.iter() if element.tag in drawn and id(element) not in hidden]


def _is_shared(piece: ElementTree.Element) -> bool:
    """Return whether a piece is a definition: a marker, or where something is cut off."""
    name = piece.get("id", "")
    return bool(name) and (piece.tag == f"{_SVG_TAG}clipPath" or (piece.tag == f"{_SVG_TAG}path" and name[5:6] == "m"))


def _plain(piece: ElementTree.Element) -> str:
    text = ElementTree.tostring(piece, encoding="unicode")
    return re.sub(r"\s+", " ", re.sub(r' xmlns(:\w+)?="[^"]*"', "", text)).replace(" />", "/>").strip()


def _common(each: Sequence[Sequence[str]]) -> list[str]:
    """Return what every pose has once, in the one order that all have it in."""
    once = [{piece for piece in pieces if pieces.count(piece) == 1} for pieces in each]
    shared = set.intersection(*once)
    first = [piece for piece in each[0] if piece in shared]
    same = all([piece for piece in pieces if piece in shared] == first for pieces in each)
    return first if same else []
