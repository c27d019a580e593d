"""Paths of equilibria: predictor and corrector, singular points, branch switching, limit points, starts and ends.

A constant whose line gives no reason of its own is an order of magnitude: ten times more or less changes no status, no
event, no stability and no force of 18 paths (`benchmarks/continuation_constants.py`, which names the two exceptions).
"""
