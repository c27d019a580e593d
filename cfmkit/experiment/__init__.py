"""Recordings of a test rig: read, split, filtered, measured; models compared with them, fitted or corrected by them.

`reading` reads a file as it comes, `branches` splits it at reversals, `corrections_and_low_pass` smooths each branch,
`curves_and_metrics_of_recording` puts the numbers together.
"""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(__name__, {"comparison": "compare", "recorded_values": "define_recorded_values"})
