"""Definitions of the numbers of a recording, beside the metrics of any curve: name -> (dimension, definition).

``{}`` in a definition stands for what was measured, and "effort" for its dimension: force or torque.
"""

from __future__ import annotations

from cfmkit.numerics.holes_in_samples import HOLE_STEP_RATIO

_OVER_WINDOW = "over the measured travel in the window"
RECORDED_VALUES = {
    "coverage": (
        "ratio",
        f"part of the window that was recorded, from steps of more than {HOLE_STEP_RATIO:g} usual ones; of "
        f"several cycles the "
        "least",
    ),
    "repeatability": (
        "effort",
        "sqrt(mean over the window of the variance (n - 1) of the {} between cycles at the same place)",
    ),
    "data_rmse": ("effort", f"root mean square of (model - measured) {{}}, {_OVER_WINDOW}"),
    "data_error_max": ("effort", "(model - measured) {} where it is largest in magnitude, in the window"),
    "data_offset": ("effort", f"mean of (model - measured) {{}}, {_OVER_WINDOW}"),
    "data_loss": ("energy", "area between the measured branches over the window"),
    "data_loss_factor": (
        "ratio",
        "data_loss over 2 pi times the area under the mean of the branches over the window, which is the energy stored",
    ),
    "data_half_gap": ("effort", "half the mean difference of the measured {} on the way up and back"),
}


def define_recorded_values(kind: str) -> dict[str, tuple[str, str]]:
    """Return name, dimension and definition of each of them, of a force or of a torque.

    Examples
    --------
    >>> define_recorded_values("torque")["torque_repeatability"][0]
    'torque'
    """
    return {
        f"{kind}_repeatability" if name == "repeatability" else name: (
            kind if dimension == "effort" else dimension,
            definition.format(kind),
        )
        for name, (dimension, definition) in RECORDED_VALUES.items()
    }
