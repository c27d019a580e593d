"""Numerical methods; no mechanism words here."""
