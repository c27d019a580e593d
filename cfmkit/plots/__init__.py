"""Pictures: data in, artists on an Axes out; one look for all families.

`style` is the look, `label_placement` finds room for names, `curves` and `loop_figure`
draw force over displacement, `bands` the requirements on it, `line_chart` everything
else over a common axis, `parts` mechanical parts to scale, `figures` all that there is of a result.
"""

from cfmkit.plots.font_cache import find_room

find_room()  # before any file of this package imports matplotlib, which reads where it may write
