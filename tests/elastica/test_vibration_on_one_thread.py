"""Frequencies are computed with one thread of BLAS."""

from cfmkit.elastica.vibration import frequencies


def test_frequencies_ask_for_one_thread():
    assert frequencies.__wrapped__ is not None
