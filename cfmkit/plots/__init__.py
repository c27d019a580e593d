"""Pictures: data in, artists on an Axes out; one look for all families.

`style` is the look, `place` writes names where nothing else is, `curves` and `loop`
draw force over displacement, `bands` the requirements on it, `diagram` everything
else over a common axis, `parts` mechanical parts to scale, `render` all of it as PNG.
"""
