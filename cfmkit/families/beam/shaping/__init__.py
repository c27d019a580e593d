"""Shape optimisation of beam networks: node positions and shape coefficients for a flat force over a window.

`Task` says what is to be shaped and what must hold, `search` improves one start,
`multistart` judges the outcome on terms that the search does not use.
"""
