"""Settings of all tests: property tests try the same examples in every run, unless a search for new ones is asked for.

``CFMKIT_TEST_SEARCH=1 pytest`` draws new examples.
"""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile("repeat", derandomize=True)
settings.register_profile("search", derandomize=False)
settings.load_profile("search" if os.environ.get("CFMKIT_TEST_SEARCH") else "repeat")
