"""One look for every picture: sizes in print millimetres, colours, settings of matplotlib, and PNG bytes that repeat.

Everything is drawn on a bare `Figure` with the Agg canvas. Settings apply inside
`style()` only, and start from matplotlib's own defaults: what a user's matplotlibrc
or session sets changes no picture, and nothing of theirs is changed.

Blue and vermillion are those of [OI]; the other line colours were chosen to differ from
them and from each other for readers with any colour vision (CIE distance 30 or more
under the simulated deficiencies of [M]). Shades carry no meaning without their text.

Reference
---------
[OI] M. Okabe, K. Ito, Color universal design, 2008.
[M] G. Machado et al., IEEE Trans. Vis. Comput. Graph. 15 (2009) 1291.
"""

from __future__ import annotations

import struct
import warnings
import zlib
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from functools import cache, wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cfmkit.plots.figure_width import active_layout
from cfmkit.plots.numbers_in_drawings import WholeNumbers

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from matplotlib.axes import Axes
    from matplotlib.colorbar import Colorbar
    from matplotlib.figure import SubFigure
    from numpy.typing import NDArray

    from cfmkit.plots.overlay import EarlierCurve

Look = dict[str, Any]  # arguments of a function of matplotlib that say how something looks
Arguments = ParamSpec("Arguments")
ReturnT = TypeVar("ReturnT")
INCHES_PER_MM = 1.0 / 25.4  # inches in a millimetre
PNG_DPI = 200
"""Dots per inch of every PNG: 160 x 100 mm become 1260 x 787 pixels, which a screen shows whole and where a line of
0.5 pt is more than one pixel wide."""
LINE_COLOURS = ("#0072B2", "#D55E00", "#1A1A1A", "#9933FF", "#C28570", "#663300")
"""Colours of lines, in this order; as dark as they must be to be read as text, too."""
LINE_BLUE, LINE_VERMILLION, LINE_BLACK, LINE_PURPLE, LINE_TAN, LINE_BROWN = LINE_COLOURS
SPRING_OCHRE = "#B78C66"
"""Springs. It stands beside every line but TAN, and beside GREY."""
TEXT_INK, TEXT_GREY = "#262626", "#6B6B6B"
BAND_GREEN, TROUBLE_RED = "#00855F", "#A50F15"
"""Where the force should be, and where something is wrong."""
SMALL_FONT, NORMAL_FONT = 7.0, 8.0  # font sizes [pt]: 7 is the smallest that Elsevier's journals print
_STYLE_SETTINGS: dict[str, Any] = {
    "font.family": ["DejaVu Sans"],  # comes with matplotlib, so every machine has the same
    "font.size": NORMAL_FONT,
    "text.color": TEXT_INK,
    # A name such as "$5 spring" is not a formula.
    "text.parse_math": False,
    "axes.labelsize": NORMAL_FONT,
    "axes.labelcolor": TEXT_INK,
    "axes.edgecolor": TEXT_GREY,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.5,
    "xtick.labelsize": SMALL_FONT,
    "ytick.labelsize": SMALL_FONT,
    "xtick.color": TEXT_GREY,
    "ytick.color": TEXT_GREY,
    "xtick.labelcolor": TEXT_INK,
    "ytick.labelcolor": TEXT_INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "lines.linewidth": 1.4,
    "lines.solid_capstyle": "round",
    "lines.dashed_pattern": (4.0, 2.0),
    "hatch.linewidth": 0.5,
    "figure.dpi": PNG_DPI,
    "savefig.dpi": PNG_DPI,
}


@cache
def _style_parameters() -> Any:
    """Return matplotlib's defaults with our settings on top; the backend is not ours to choose."""
    fixed = ("backend", "backend_fallback", "interactive")
    defaults = {name: value for name, value in matplotlib.rcParamsDefault.items() if name not in fixed}
    return defaults | _STYLE_SETTINGS


_INSIDE_STYLE: ContextVar[bool] = ContextVar("inside", default=False)
_SETTINGS_OF_USER: ContextVar[tuple[tuple[str, Any], ...]] = ContextVar("settings", default=())
_SHOW_TITLES: ContextVar[bool] = ContextVar("titles", default=True)
_PLAIN_STYLE: ContextVar[bool] = ContextVar("plain", default=False)
_STYLE_OVERLAY: ContextVar[EarlierCurve | None] = ContextVar("overlay", default=None)


@contextmanager
def style() -> Iterator[None]:
    """Apply the look inside a ``with`` block; outside, everything stays as it was."""
    if _INSIDE_STYLE.get():
        yield
        return
    mark = _INSIDE_STYLE.set(True)
    try:
        with matplotlib.rc_context(_style_parameters() | dict(_SETTINGS_OF_USER.get())), warnings.catch_warnings():
            # a name in letters that the font lacks is drawn as boxes; that is no reason to alarm anyone
            warnings.filterwarnings("ignore", message="Glyph .* missing from font")
            yield
    finally:
        _INSIDE_STYLE.reset(mark)


def apply_style(function: Callable[Arguments, ReturnT]) -> Callable[Arguments, ReturnT]:
    """Return a drawing function that works inside `style()`."""

    @wraps(function)
    def call_styled(*args: Arguments.args, **kwargs: Arguments.kwargs) -> ReturnT:
        with style():
            return function(*args, **kwargs)

    return call_styled


@apply_style
def new_figure(width_mm: float = 160.0, height_mm: float = 100.0) -> Figure:
    """Return an empty figure of a print size in millimetres, on the Agg canvas; in a layout, the one that it has."""
    layout = active_layout()
    if layout is not None:
        width_mm, height_mm = layout.record_size(width_mm, height_mm)
    figure = Figure(figsize=(width_mm * INCHES_PER_MM, height_mm * INCHES_PER_MM))
    FigureCanvasAgg(figure)
    return figure


@apply_style
def new_axes() -> Axes:
    """Return axes that fill a new figure of `matplotlib.pyplot` (160 x 100 mm), which notebooks show."""
    from matplotlib import pyplot

    figure = pyplot.figure(figsize=(160.0 * INCHES_PER_MM, 100.0 * INCHES_PER_MM))
    return axes_mm(figure, (17.0, 12.0, 138.0, 84.0))


def size_mm(figure: Figure | SubFigure) -> tuple[float, float]:
    """Return width and height of a figure [mm of print]."""
    dots = figure.dpi * INCHES_PER_MM
    return float(figure.bbox.width) / dots, float(figure.bbox.height) / dots


def has_titles() -> bool:
    """Return whether headings are to be written."""
    return _SHOW_TITLES.get() and not is_plain()


def is_plain() -> bool:
    """Return whether lines, their names and axes are all: no bands, no notes, no marks, no headings."""
    return _PLAIN_STYLE.get()


def overlay() -> EarlierCurve | None:
    """Return the curve of an earlier run that is drawn beside the nominal one; None if there is none."""
    return _STYLE_OVERLAY.get()


@contextmanager
def with_settings(
    settings: tuple[tuple[str, Any], ...] = (),
    titles: bool = True,
    plain: bool = False,
    overlay: EarlierCurve | None = None,
) -> Iterator[None]:
    """Apply settings of matplotlib, whether headings and notes are written, and an overlay, inside a ``with`` block."""
    with ExitStack() as stack:
        for variable, value in (
            (_SETTINGS_OF_USER, settings),
            (_SHOW_TITLES, titles),
            (_PLAIN_STYLE, plain),
            (_STYLE_OVERLAY, overlay),
        ):
            stack.callback(variable.reset, variable.set(value))  # type: ignore[arg-type]
        yield


@apply_style
def png(figure: Figure, dpi: float | None = None) -> bytes:
    """Return the figure as PNG: the same bytes for the same content and library versions."""
    dpi = float(matplotlib.rcParams["savefig.dpi"]) if dpi is None else dpi
    canvas = figure.canvas if isinstance(figure.canvas, FigureCanvasAgg) else FigureCanvasAgg(figure)
    before = figure.dpi
    figure.dpi = dpi
    try:
        canvas.draw()  # type: ignore[no-untyped-call]
        pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        return _encode_png(pixels[:, :, :3], dpi)
    finally:
        figure.dpi = before


def _encode_png(rgb: NDArray[np.uint8], dpi: float) -> bytes:
    """Return pixels (height, width, 3) as PNG; half the time of matplotlib's own writer, and no metadata."""
    height, width, _ = rgb.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # every row begins with its filter: 0, none
    rows[:, 1:] = rgb.reshape(height, -1)
    per_metre = round(dpi / 0.0254)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
        (b"pHYs", struct.pack(">IIB", per_metre, per_metre, 1)),
        (b"IDAT", zlib.compress(rows.tobytes(), 3)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(_png_chunk(*chunk) for chunk in chunks)


def _png_chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


@apply_style
def axes_mm(figure: Figure, box: tuple[float, float, float, float], **options: Any) -> Axes:
    """Return new axes in a box (left, bottom, width, height) [mm of print]."""
    width, height = size_mm(figure)
    layout = active_layout()
    left, bottom, across, up = box if layout is None else layout.place_box(box)
    axes = figure.add_axes((left / width, bottom / height, across / width, up / height), **options)
    if layout is not None:
        layout.axes.append(axes)
    axes.xaxis.set_major_formatter(WholeNumbers())
    axes.yaxis.set_major_formatter(WholeNumbers())
    return axes


@apply_style
def color_bar(shades: Any, axes: Axes, label: str = "", **options: Any) -> Colorbar:
    """Fill axes with the key of colours, whose ticks are written like those of every other axis."""
    bar = axes.figure.colorbar(shades, cax=axes, format=WholeNumbers(), **options)
    bar.set_label(label)
    return bar
