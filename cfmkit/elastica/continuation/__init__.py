"""Paths of equilibria: predictor and corrector, singular points, branch switching, limit points, starts and ends."""
