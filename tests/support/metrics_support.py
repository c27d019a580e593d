"""Small curves for metrics, and what is measured on them."""

import numpy as np

from cfmkit.curves import Column, Curve
from cfmkit.metrics import MeasuringFrame, Window, measure

BARE = MeasuringFrame()


def curve(*branches, kind="force", stress=None, names=("load", "unload")):
    """Return a curve from (motion, effort) pairs; the second pair is stored as it is given."""
    motion = np.concatenate([np.asarray(x, float) for x, _ in branches])
    effort = np.concatenate([np.asarray(f, float) for _, f in branches])
    labels = np.concatenate([[name] * len(x) for name, (x, _) in zip(names, branches, strict=False)])
    extra = {} if stress is None else {"max_stress": Column(np.asarray(stress, float), "stress")}
    return Curve(motion, effort, labels, np.ones(len(motion), bool), extra, kind)


def value(metric, of, frame=BARE, window=None):
    found = measure(of, frame, Window(*window) if window else None)[metric]
    assert found.value is not None, found.reason
    return found.value


def reason(metric, of, frame=BARE, window=None):
    found = measure(of, frame, Window(*window) if window else None)[metric]
    assert found.value is None
    return found.reason


SAW = curve(([0, 1, 2, 3, 4], [8, 10, 9, 11, 12]))
LOOP = curve(([0, 1, 2], [10, 12, 14]), ([2, 1, 0], [13, 11, 9]))
