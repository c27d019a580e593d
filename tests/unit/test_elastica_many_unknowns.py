"""The lowest frequencies of a network of many unknowns are those that all of its eigenvalues would give."""

import numpy as np
import pytest
from scipy.linalg import block_diag, eigh

from cfmkit.elastica.vibration import natural_frequencies


def system(n, seed=3):
    """Return a stiffness like that of beams, its eigenvalues spread over ten decades, and a mass."""
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.standard_normal((n, n)))
    stiffness = turn @ np.diag(np.logspace(0.0, 8.0, n)) @ turn.T
    mixed = random.standard_normal((n, n)) / n
    return 0.5 * (stiffness + stiffness.T), np.eye(n) + mixed @ mixed.T


@pytest.mark.parametrize("twice", [False, True])
def test_few_frequencies_of_many_unknowns_are_those_of_all(twice):
    """Equal ones, of two parts that do not touch, are found as often as they occur."""
    stiffness, mass = system(140 if twice else 260)
    if twice:
        stiffness, mass = block_diag(stiffness, stiffness), block_diag(mass, mass)
    assert len(stiffness) > natural_frequencies._SMALL
    found = natural_frequencies._symmetric(stiffness, mass, 4)
    every = 1.0 / eigh(mass, stiffness, eigvals_only=True)[::-1]  # so that rounding is that of the lowest ones
    np.testing.assert_allclose(found, every[:4], rtol=1e-9)
    if twice:
        np.testing.assert_allclose(found[::2], found[1::2], rtol=1e-9)


def test_few_frequencies_of_many_unknowns_need_no_whole_spectrum(monkeypatch):
    import scipy.linalg

    def whole(*_args, **_options):
        raise AssertionError("all eigenvalues were computed")

    stiffness, mass = system(260)
    monkeypatch.setattr(scipy.linalg, "eigh", whole)
    assert np.isfinite(natural_frequencies._symmetric(stiffness, mass, 2)).all()
