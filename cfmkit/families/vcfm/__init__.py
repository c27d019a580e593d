"""Mechanisms of snap-through leaves and a preloaded spring [Ding, Li and Li 2022]."""
