"""The picture of all proposals of a request: each as it is made, to one scale, in the envelope."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

from cfmkit.families import family
from cfmkit.families.run_control import Run
from cfmkit.plots.style import BAND_GREEN, NORMAL_FONT, SMALL_FONT, TEXT_GREY, apply_style, axes_mm, new_figure
from cfmkit.studies.suggest.proposal_making_and_judging import use_own_model

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cfmkit.families.proposals import Request
    from cfmkit.studies.suggest.proposal_making_and_judging import Proposal

N_COLUMNS = 3
MAX_DRAWN_PROPOSALS = 24
"""Proposals that are drawn: four families give three each and often some more; beyond it drawings get too small."""
LINE_SPACING = 3.4  # between lines of small text [mm]: 7 pt with a third of it between them
LETTER_WIDTH = 1.4  # room of one letter of small text [mm]: names of proposals take 1.33 on average (DejaVu Sans, 7 pt)


def label_proposal(number: int, proposal: Proposal) -> str:
    """Return what a proposal is called in pictures, and whether something of it was not judged."""
    return f"{number} {proposal.family}, {proposal.variant}" + (" (not judged in full)" if proposal.open else "")


@apply_style
def to_one_scale(
    proposals: Sequence[Proposal],  # the first `MAX_DRAWN_PROPOSALS` are drawn
    request: Request,  # its envelope is dashed
    links: Sequence[str] = (),  # where each drawing leads on a page; none in a picture
) -> Figure:
    """Return every proposal as it is made, to one scale, in the envelope."""
    drawn = [_find_drawing(proposal) for proposal in proposals[:MAX_DRAWN_PROPOSALS]]
    sizes = [_envelope_in_drawing(space, request) for _, space in drawn]
    wide, high = (max(size[k] for size in sizes) * 1.08 for k in (0, 1))
    rows = -(-len(drawn) // N_COLUMNS)
    columns = min(N_COLUMNS, len(drawn))
    names = [
        _wrap_text(150.0 / columns - 2.0, label_proposal(number, proposal))
        for number, proposal in enumerate(proposals[:MAX_DRAWN_PROPOSALS], 1)
    ]
    above = 3.5 + LINE_SPACING * max(len(text.split("\n")) for text in names)
    scale = min(150.0 / (columns * wide), 190.0 / (rows * high), 90.0 / max(wide, high))
    cell = wide * scale, high * scale
    figure = new_figure(160.0, rows * (cell[1] + above) + 14.0)
    total = figure.get_figheight() * 25.4
    for number, ((moving, space), size) in enumerate(zip(drawn, sizes, strict=True)):
        row, column = divmod(number, N_COLUMNS)
        place = 5.0 + column * (150.0 / columns)
        below = total - 8.0 - (row + 1) * (cell[1] + above)
        ax = axes_mm(figure, (place + 0.5 * (150.0 / columns - cell[0]), below, *cell))
        (moving.draw_as_made or moving.draw)(ax, 0)
        _frame(ax, space, size, (wide, high))
        # from the column's edge on, where a name has the room that it is broken for
        name = figure.text(
            place / 160.0, (below + cell[1] + 0.5) / total, names[number], fontsize=SMALL_FONT, va="bottom"
        )
        if links:
            name.set_url(links[number])
            _link_axes(ax, links[number])
    figure.text(
        0.02,
        1.0 - 5.0 / total,
        "Proposals in the envelope, same scale" + _count_left_out(proposals),
        fontsize=NORMAL_FONT,
    )
    figure.text(0.02, 1.5 / total, _describe_scale(request), fontsize=SMALL_FONT, color=TEXT_GREY)
    return figure


def _link_axes(ax: Axes, link: str) -> None:
    """Lay over axes what leads to a link where it is clicked."""
    from matplotlib.patches import Rectangle

    ax.add_patch(Rectangle((0.0, 0.0), 1.0, 1.0, transform=ax.transAxes, alpha=0.0, zorder=9, url=link))


def _count_left_out(proposals: Sequence[Proposal]) -> str:
    """Return how many proposals a picture leaves to the table; nothing if it shows all."""
    more = len(proposals) - MAX_DRAWN_PROPOSALS
    return f" (the first {MAX_DRAWN_PROPOSALS}; {more} more in the table)" if more > 0 else ""


def _wrap_text(width: float, text: str) -> str:
    """Return small text on as many lines as a width [mm] asks for."""
    return textwrap.fill(text, int(width / LETTER_WIDTH))


def _describe_scale(request: Request) -> str:
    sides = " x ".join(f"{1e3 * side:.4g}" for side in request.envelope[:2])
    return f"Dashed: envelope, {sides} mm" + (" across and along the travel" if request.kind == "force" else "")


def _find_drawing(proposal: Proposal) -> Any:
    """Return what draws a proposal, and its own envelope."""
    record = family(proposal.family)
    result = record.analyze(use_own_model(proposal), Run())
    assert record.draw is not None
    assert record.draw.moving is not None
    return record.draw.moving(result), record.envelope(result)


def _envelope_in_drawing(space: Any, request: Request) -> tuple[float, float]:
    """Return width and height of the envelope as it lies in the family's drawings [m]."""
    across, along = request.envelope[:2]
    if request.kind == "torque":
        # what turns may lie either way: the long side where it is long itself
        long, short = max(across, along), min(across, along)
        width, height = (space.along, space.across) if space.sideways else (space.across, space.along)
        return (long, short) if width >= height else (short, long)
    return (along, across) if space.sideways else (across, along)


def _frame(ax: Axes, space: Any, size: tuple[float, float], view: tuple[float, float]) -> None:
    """Draw the envelope around a mechanism, in the middle of a view."""
    from matplotlib.patches import Rectangle

    sides = (space.along, space.across) if space.sideways else (space.across, space.along)
    middle = [1e3 * (corner + 0.5 * side) for corner, side in zip(space.corner, sides, strict=True)]
    corner = [at - 500.0 * side for at, side in zip(middle, size, strict=True)]
    look: dict[str, Any] = {
        "fill": False,
        "edgecolor": BAND_GREEN,
        "linewidth": 0.8,
        "linestyle": (0, (5, 2)),
        "zorder": 6,
    }
    ax.add_patch(Rectangle((corner[0], corner[1]), 1e3 * size[0], 1e3 * size[1], **look))
    ax.set_xlim(middle[0] - 500.0 * view[0], middle[0] + 500.0 * view[0])
    ax.set_ylim(middle[1] - 500.0 * view[1], middle[1] + 500.0 * view[1])
    ax.set_axis_off()


__all__ = ["label_proposal", "to_one_scale"]
