"""Settings of all tests.

The families in `plugins` take part, installed or not. Property tests try the same examples in every run, unless a
search for new ones is requested: ``CFMKIT_TEST_SEARCH=1 pytest`` draws new examples.
"""

from __future__ import annotations

import os

import blas_threads  # noqa: F401 before numpy
import plugin_support
from hypothesis import settings

plugin_support.register()

settings.register_profile("repeat", derandomize=True)
settings.register_profile("search", derandomize=False)
settings.load_profile("search" if os.environ.get("CFMKIT_TEST_SEARCH") else "repeat")
