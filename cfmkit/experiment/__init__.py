"""Measured curves: reading lab files, branches, filters, hysteresis, and what a model makes of them.

`reading` reads a file as it comes, `branches` splits it
at reversals, `low_pass` smooths each branch, `curves_and_metrics_of_recording` puts the numbers together.
"""

from cfmkit.experiment.value_definitions import define_recorded_values

__all__ = ["define_recorded_values"]
