"""Derivatives of outputs by design variables, and the equilibria of networks that differ little."""
