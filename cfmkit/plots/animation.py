"""Animation of the moving mechanism beside its curve, for slides: the bytes of a GIF or an mp4.

The poses are those of the HTML page (`cfmkit.plots.poses_in_one_svg`), forth and back. An mp4 needs the program
``ffmpeg``.
"""

from __future__ import annotations

import io
import shutil
import subprocess
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import UsageError
from cfmkit.plots.style import LINE_COLOURS, NORMAL_FONT, TEXT_GREY, TROUBLE_RED, apply_style, axes_mm, new_figure
from cfmkit.specs.units import border_unit, to_border

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from cfmkit.plots.poses_in_one_svg import Moving
    from cfmkit.results import Result

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
    known = effort[np.isfinite(effort)]
    low, high = np.percentile(known, [1, 99]) if len(known) else (0.0, 1.0)
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
    return _gif(whole) if kind == "gif" else _film(whole)


def require_ffmpeg() -> str:
    """Return where ``ffmpeg`` is.

    Raises UsageError if it is not there.
    """
    if (program := shutil.which("ffmpeg")) is None:
        raise UsageError("--animate mp4 needs the program ffmpeg, which is not there; --animate gif needs nothing")
    return program


def _gif(whole: Sequence[NDArray[np.uint8]]) -> bytes:
    from PIL import Image

    first, *more = (Image.fromarray(frame).quantize(64, dither=Image.Dither.NONE) for frame in whole)
    into = io.BytesIO()
    first.save(into, "GIF", save_all=True, append_images=more, duration=FRAME_DURATION, loop=0)
    return into.getvalue()


def _film(whole: Sequence[NDArray[np.uint8]]) -> bytes:
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
