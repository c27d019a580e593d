"""Form of the figures: formats, width of print, headings, and a style file of one's own.

A drawing says its sizes in millimetres of print (`cfmkit.plots.style.new_figure`, `axes_mm`). For another width
`cfmkit.plots.figure_width` lays it out anew, so no drawing needs to know of other widths.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from cfmkit.errors import UsageError, reason_of, visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from matplotlib.figure import Figure

    from cfmkit.plots.overlay import EarlierCurve

FIGURE_FORMATS = ("png", "svg", "pdf")
MIN_PRINT_WIDTH, MAX_PRINT_WIDTH = 0.06, 0.6
"""Widths of print that are allowed [m]: below, axes have no room beside their labels; above, no page is as wide."""


@dataclass(frozen=True)
class FigureForm:
    """Form of the figures."""

    formats: tuple[str, ...] = ("png",)  # one file for each
    width: float | None = None  # of the print [m]; default: each figure as it is drawn
    titles: bool = True  # whether headings stand above figures; in print the caption says what they say
    plain: bool = False  # for journals: no bands, notes, marks or headings
    overlay: EarlierCurve | None = field(default=None, compare=False, repr=False)  # of an earlier run
    settings: tuple[tuple[str, Any], ...] = field(default=(), repr=False)  # of matplotlib, on top of ours

    @property
    def is_default(self) -> bool:
        """Whether nothing but the default is requested."""
        return self == DEFAULT_FORM

    def draw(self, make: Callable[[], Figure]) -> Figure:
        """Return a figure in this form."""
        from cfmkit.plots.figure_width import draw_in_width
        from cfmkit.plots.style import style, with_settings

        titles = self.titles and not self.plain
        with with_settings(self.settings, self.titles, self.plain, self.overlay), style():
            if self.width is None and titles:
                return make()
            return draw_in_width(make, None if self.width is None else self.width * 1e3, titles)

    def write(self, figure: Figure, stem: str) -> Iterator[tuple[str, bytes]]:
        """Yield a figure's files as (name, content), below ``figures/``."""
        from cfmkit.plots.style import with_settings
        from cfmkit.plots.vector_formats import write_figure

        for kind in self.formats:
            with with_settings(self.settings, self.titles, self.plain):
                content = write_figure(figure, kind)
            yield f"figures/{stem}.{kind}", content

    def files(self, makers: Mapping[str, Callable[[], Figure]]) -> Iterator[tuple[str, bytes]]:
        """Yield the files of figures as (name, content), each when it is needed."""
        for stem, make in makers.items():
            yield from self.write(self.draw(make), stem)

    def select_page_figures(
        self,
        makers: Mapping[str, Callable[[], Figure]],  # what draws each of them
        # those that were drawn in this form already; they serve where it is no other than a page's
        drawn: Mapping[str, Figure],
    ) -> dict[str, Figure]:
        """Return figures as a page shows them: with its own headings and width, whatever is drawn for print."""
        form = FigureForm(overlay=self.overlay)
        figures = drawn if replace(self, formats=("png",)).is_default else {}
        return {stem: figures[stem] if stem in figures else form.draw(make) for stem, make in makers.items()}


DEFAULT_FORM = FigureForm()  # PNG, as each figure is drawn


def form_of(
    formats: str | None = None,  # names with commas between them
    width: str | None = None,  # a length with its unit
    titles: bool = True,  # whether figures have headings
    style: str | None = None,  # path of a style file of matplotlib
    plain: bool = False,  # whether they are for a journal: without bands, notes, marks and headings
    overlay: str | None = None,  # output folder of an earlier run, whose curve is drawn as well
) -> FigureForm:
    """Return the form that options ask for.

    Raises UsageError if one of them is malformed, or the folder has no curve.

    Examples
    --------
    >>> form_of("svg, pdf", "84 mm").formats
    ('svg', 'pdf')
    """
    listed = ("png" if formats is None else formats).split(",")
    names = tuple(dict.fromkeys(name.strip().lower() for name in listed if name.strip()))
    if unknown := [name for name in names if name not in FIGURE_FORMATS] or ([""] if not names else []):
        formats = ", ".join(FIGURE_FORMATS)
        raise UsageError(f"--figures: there is no format {visible(unknown[0])!r}; there are {formats}")
    from cfmkit.plots.overlay import read_earlier

    earlier = None if overlay is None else read_earlier(overlay)
    looks = () if style is None else settings(style)
    return FigureForm(names, None if width is None else _read_width(width), titles, plain, earlier, looks)


def _read_width(text: str) -> float:
    from cfmkit.errors import QuantityError
    from cfmkit.specs.units import read_quantity

    try:
        value = float(read_quantity(text, "length"))
    except QuantityError as error:
        raise UsageError(f"--figure-width: {error}") from None
    if not MIN_PRINT_WIDTH <= value <= MAX_PRINT_WIDTH:
        raise UsageError(f"--figure-width: {visible(text)} is not allowed: must be 60 mm ... 600 mm")
    return value


FIXED_SETTINGS = ("backend", "svg.", "pdf.", "ps.", "savefig.format", "savefig.bbox", "text.usetex", "figure.figsize")
"""How the settings begin that a style file cannot change: they would undo what makes files whole and repeatable."""


def settings(path: str) -> tuple[tuple[str, Any], ...]:
    """Return the settings in a style file of matplotlib, in the order of their names.

    Raises UsageError if it cannot be read, or says something that matplotlib does not know or that is not a file's to
    change.
    """
    import logging
    import warnings

    import matplotlib

    reported: list[str] = []  # matplotlib tells of the faults of a file in its log
    teller = logging.Handler()
    teller.emit = lambda record: reported.append(record.getMessage())  # type: ignore[method-assign]
    log = logging.getLogger("matplotlib")
    log.addHandler(teller)
    before, log.propagate = log.propagate, False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            read: Any = matplotlib.rc_params_from_file(path, fail_on_error=False, use_default_template=False)
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"--figure-style: {visible(path)} cannot be read: {reason_of(error)}") from None
    except Exception as error:
        raise UsageError(f"--figure-style: {visible(path)}: {' '.join(str(error).split())}") from None
    finally:
        log.removeHandler(teller)
        log.propagate = before
    if reported:
        first, _, _ = " ".join(reported[0].split()).partition(" You probably need")  # then come its own addresses
        raise UsageError(f"--figure-style: {visible(path)}: {visible(first)}")
    if fixed := next((name for name in read if name.startswith(FIXED_SETTINGS)), None):
        raise UsageError(f"--figure-style: {visible(path)}: {fixed} is not a style file's to change")
    return tuple(sorted(dict(read).items()))
