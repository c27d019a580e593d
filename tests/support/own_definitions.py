"""A metric of a program's own, in a module that other processes can import."""

from __future__ import annotations


def peak_to_peak(result):
    """Return the largest effort minus the smallest one, of both branches."""
    return result.curve.effort.max() - result.curve.effort.min()
