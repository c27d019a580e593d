"""Pictures: data in, artists on an Axes out; one look for all families.

`style` is the look, `place` writes names where nothing else is, `curves` and `loop`
draw force over displacement, `bands` the requirements on it, `diagram` everything
else over a common axis, `parts` mechanical parts to scale, `figures` all that there is of a result.
"""

from cfmkit.plots.home import find_room

find_room()  # before any file of this package imports matplotlib, which reads where it may write
