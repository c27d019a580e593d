"""A mechanism in motion: as one SVG for pages, and as an animation beside its curve, for slides.

In the SVG what never moves stands once, what moves once for every pose. The families draw a pose on axes as they do for
their figures; what two poses have in common is found by comparing what is drawn. So a page needs no drawing code of its
own, and a script has nothing to do but to show one pose. An animation has these poses, forth and back, as the bytes of
a GIF or an mp4, which needs the program ``ffmpeg``.
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from cfmkit.errors import UsageError
from cfmkit.plots.style import LINE_COLOURS, NORMAL_FONT, TEXT_GREY, TROUBLE_RED, apply_style, axes_mm, new_figure
from cfmkit.plots.vector_formats import inline, svg
from cfmkit.specs.units import border_unit, to_border

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.results import Result


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
    artists = set(ax.get_children())
    drawn = []
    for number in numbers:
        moving.draw(ax, number)
        drawn.append(ElementTree.fromstring(inline(svg(figure), "film")))
        for artist in set(ax.get_children()) - artists:
            artist.remove()
    return drawn


def _merge_poses(poses: Sequence[ElementTree.Element], title: str) -> str:
    """Return poses as one: runs of what differs between pieces that all of them have, in the order of drawing."""
    ElementTree.register_namespace("", _SVG_NAMESPACE)
    ElementTree.register_namespace("xlink", _XLINK_NAMESPACE)
    elements = [[_comparable_text(element) for element in _drawn_pieces(pose)] for pose in poses]
    common = _common_pieces(elements)
    body: list[str] = []
    at = [0] * len(elements)
    for anchor in [*common, None]:
        runs = []
        for number, pieces in enumerate(elements):
            end = pieces.index(anchor, at[number]) if anchor is not None else len(pieces)
            runs.append(pieces[at[number] : end])
            at[number] = end + 1
        body += [f'<g class="pose" data-pose="{number}">{"".join(run)}</g>' for number, run in enumerate(runs) if run]
        body += [] if anchor is None else [anchor]
    shared: dict[str, str] = {}
    for pose in poses:
        shared |= {piece.get("id", ""): _comparable_text(piece) for piece in pose.iter() if _is_shared(piece)}
    box = poses[0].get("viewBox", "")
    return (
        f'<svg xmlns="{_SVG_NAMESPACE}" xmlns:xlink="{_XLINK_NAMESPACE}" viewBox="{box}" role="img" '
        f"aria-label={quoteattr(title)}>"
        f"<defs>{''.join(shared.values())}</defs>{''.join(body)}</svg>"
    )


def _drawn_pieces(pose: ElementTree.Element) -> list[ElementTree.Element]:
    """Return what is drawn, in order: paths, uses and texts that stand in no definition."""
    hidden = {id(inner) for block in pose.iter(f"{_SVG_TAG}defs") for inner in block.iter()}
    drawn = {f"{_SVG_TAG}{kind}" for kind in ("path", "use", "text", "image")}
    return [element for element in pose.iter() if element.tag in drawn and id(element) not in hidden]


def _is_shared(piece: ElementTree.Element) -> bool:
    """Return whether a piece is a definition: a marker, or where something is cut off."""
    name = piece.get("id", "")
    return bool(name) and (piece.tag == f"{_SVG_TAG}clipPath" or (piece.tag == f"{_SVG_TAG}path" and name[5:6] == "m"))


def _comparable_text(piece: ElementTree.Element) -> str:
    text = ElementTree.tostring(piece, encoding="unicode")
    return re.sub(r"\s+", " ", re.sub(r' xmlns(:\w+)?="[^"]*"', "", text)).replace(" />", "/>").strip()


def _common_pieces(elements: Sequence[Sequence[str]]) -> list[str]:
    """Return what every pose has once, in the one order that all have it in."""
    once = [{piece for piece in pieces if pieces.count(piece) == 1} for pieces in elements]
    shared = set.intersection(*once)
    first = [piece for piece in elements[0] if piece in shared]
    same = all([piece for piece in pieces if piece in shared] == first for pieces in elements)
    return first if same else []


FRAME_WIDTH, FRAME_HEIGHT = 240.0, 100.0
"""Size of a frame [mm]; with `DOTS_PER_INCH` it has 960 x 400 pixels, half a slide."""
DOTS_PER_INCH = 101.6
"""Pixels per inch: four per millimetre, so that width and height are even numbers of pixels, as mp4 needs."""
FRAME_DURATION = 90  # duration of each frame [ms]: with 11 a second, forth and back takes three seconds


@apply_style
def frames(result: Result, moving: Moving) -> list[NDArray[np.uint8]]:
    """Return the frames of one sweep, (height, width, 3) each: the mechanism, and a cursor in its curve."""
    figure = new_figure(FRAME_WIDTH, FRAME_HEIGHT)
    figure.dpi = DOTS_PER_INCH
    left, bottom, right, top = moving.box
    scale = min(104.0 / (right - left), 88.0 / (top - bottom))
    size = ((right - left) * scale, (top - bottom) * scale)
    mechanism_axes = axes_mm(figure, (60.0 - size[0] / 2.0, 48.0 - size[1] / 2.0, *size))
    diagram, curve = axes_mm(figure, (136.0, 14.0, 98.0, 74.0)), result.curve
    motion, effort = to_border(curve.motion, curve.motion_dimension), to_border(curve.effort, curve.kind)
    names = list(dict.fromkeys(curve.branches))
    for number, name in enumerate(names):
        on = curve.branch == name
        diagram.plot(motion[on], effort[on], color=LINE_COLOURS[number % len(LINE_COLOURS)], label=name)
    if len(names) > 1:
        diagram.legend(frameon=False)
    finite = effort[np.isfinite(effort)]
    low, high = np.percentile(finite, [1, 99]) if len(finite) else (0.0, 1.0)
    room = 0.1 * (max(high, 0.0) - min(low, 0.0)) or 1.0
    diagram.set_ylim(min(low, 0.0) - (room if low < 0 else 0.0), max(high, 0.0) + room)
    diagram.set_xlabel(f"{curve.motion_name} [{border_unit(curve.motion_dimension)}]")
    diagram.set_ylabel(f"{curve.kind} [{border_unit(curve.kind)}]")
    figure.text(0.02, 0.97, result.spec.name, va="top", weight="bold", size=NORMAL_FONT + 2.0)
    cursor = diagram.axvline(0.0, color=TROUBLE_RED, linewidth=1.0, linestyle="--")
    place_label = diagram.text(0.98, 0.03, "", transform=diagram.transAxes, ha="right", color=TEXT_GREY)
    places = to_border(moving.motion, curve.motion_dimension)
    frames_of_sweep = []
    for number, place in enumerate(places):
        mechanism_axes.clear()
        moving.draw(mechanism_axes, number)
        mechanism_axes.set_axis_off()
        cursor.set_xdata([place, place])
        place_label.set_text(f"{place:.4g} {border_unit(curve.motion_dimension)}")
        canvas: Any = figure.canvas
        canvas.draw()
        frames_of_sweep.append(np.asarray(canvas.buffer_rgba())[:, :, :3].copy())
    return frames_of_sweep


def animation(
    # result, moving: the solved mechanism, and its poses as its family draws them
    result: Result,
    moving: Moving,
    kind: str,  # format of the file
) -> bytes:
    """Return the mechanism in motion as the content of a file.

    Raises UsageError if a film is requested where there is no ``ffmpeg``.
    """
    if kind == "mp4":
        require_ffmpeg()
    sweep = frames(result, moving)
    whole = [*sweep, *sweep[-2:0:-1]]
    return _encode_gif(whole) if kind == "gif" else _encode_mp4(whole)


def require_ffmpeg() -> str:
    """Return where ``ffmpeg`` is.

    Raises UsageError if it is not there.
    """
    if (program := shutil.which("ffmpeg")) is None:
        raise UsageError("--animate mp4 needs the program ffmpeg, which is not there; --animate gif needs nothing")
    return program


def _encode_gif(whole: Sequence[NDArray[np.uint8]]) -> bytes:
    from PIL import Image

    first, *more = (Image.fromarray(frame).quantize(64, dither=Image.Dither.NONE) for frame in whole)
    into = io.BytesIO()
    first.save(into, "GIF", save_all=True, append_images=more, duration=FRAME_DURATION, loop=0)
    return into.getvalue()


def _encode_mp4(whole: Sequence[NDArray[np.uint8]]) -> bytes:
    import tempfile
    from pathlib import Path

    height, width, _ = whole[0].shape
    with tempfile.TemporaryDirectory(prefix="cfmkit-film-") as folder:
        out = Path(folder) / "film.mp4"  # the index of an mp4 is written last, which no pipe can do
        command = [
            *(require_ffmpeg(), "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"),
            *("-s", f"{width}x{height}", "-r", f"{1000 / FRAME_DURATION:.3f}", "-i", "-", "-an"),
            *("-pix_fmt", "yuv420p", "-movflags", "+faststart", "-fflags", "+bitexact", "-y", str(out)),
        ]
        done = subprocess.run(command, input=b"".join(map(bytes, whole)), capture_output=True, check=False)
        if done.returncode:
            complaint = " ".join(done.stderr.decode(errors="replace").split())
            raise UsageError(f"--animate mp4: ffmpeg could not write the film: {complaint[:200]}")
        return out.read_bytes()
