"""One thread for linear algebra, set when this is imported, before numpy is.

Test processes run side by side: threads of several would wait for each other, a hundred times as long as they work.
"""

from __future__ import annotations

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
