"""Pictures: data in, artists on an Axes out; one look for all families.

`style` is the look, `label_placement` finds room for names, `curves` draws force over displacement,
`bands_from_requirements` the requirements on it, `stacked_line_diagrams` everything else over a common axis, `parts`
mechanical parts to scale, `figures` all that there is of a result.
"""

from cfmkit.lazy_names import lazy_names
from cfmkit.plots.font_cache import find_room

find_room()  # before any file of this package imports matplotlib, which reads where it may write

__getattr__, __all__ = lazy_names(__name__, {"style": "axes_mm new_figure"})
