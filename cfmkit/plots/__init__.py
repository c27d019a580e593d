"""Pictures: data in, artists on an Axes out; one look for all families.

`style` is the look, `label_placement` finds room for names, `curves` and `curve_with_enlarged_band`
draw force over displacement, `bands_from_requirements` the requirements on it, `stacked_line_diagrams` everything
else over a common axis, `parts` mechanical parts to scale, `figures` all that there is of a result.
"""

from importlib import import_module
from typing import Any

from cfmkit.plots.font_cache import find_room

find_room()  # before any file of this package imports matplotlib, which reads where it may write

_NAMES_BY_MODULE = {"style": "axes_mm new_figure"}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)
