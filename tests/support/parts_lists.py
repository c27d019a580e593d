"""Parts lists as tests read them."""

from typing import Any

import cfmkit


def table(result: cfmkit.Result) -> list[dict[str, Any]]:
    """Return the parts list as one dictionary per line."""
    columns = {column.name: column.cells() for column in result.tables["parts"]().columns}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def assert_assembly_has_the_numbers_of_the_list(result: cfmkit.Result, hardware: Any) -> None:
    """Check that what is listed with a body is drawn under its number."""
    assert {part.body for part in hardware.parts if part.body} <= {body.name for body in hardware.drawn}
    assert all(part.body for part in hardware.parts if part.place == "in the rollers" and part.standard)
    figure = cfmkit.figures(result)["assembly"]()
    shown = {text.get_gid(): text.get_text() for ax in figure.axes for text in ax.texts if text.get_gid()}
    assert shown == {f"item-{k}": str(k) for k, part in enumerate(hardware.parts, start=1) if part.body}
    assert len(table(result)) == len(hardware.parts)
