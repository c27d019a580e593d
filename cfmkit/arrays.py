"""Arrays as the whole package writes them: of numbers, in SI units, read-only once they are handed out."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def read_only(values: Any, dtype: Any = np.float64) -> NDArray[Any]:
    """Return `values` as an array that cannot be written to (copied if it could be)."""
    array = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array
