"""Follow the networks of `tests/cases/networks.jsonl` on the functional and say how far they agree with the file.

    python tools/judge_trace.py [--only TEXT] [--every N] [--first K] [--seconds S] [--tolerance T]

A line a case: `agrees` with the largest difference, or what differs. Stresses and frequencies are not compared.
"""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))
from network_cases import differences, from_json, pick, read_cases

from cfmkit.elastica.tracing.trace import trace

LEVELS = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)


class Slow(Exception):
    """A case takes too long."""


def observe(path: Any) -> dict[str, Any]:
    """Return what is compared of a path."""
    at = pick(path)
    names = [name for name in path.network.nodes if not path.network.is_moved_by_link(name)] if len(at) else []
    return {
        "status": path.status.name,
        "points": len(path.at_requested),
        "requested": path.requested[at].tolist(),
        "effort": path.effort[at].tolist(),
        "unstable": path.unstable[at].tolist(),
        "events": [[event.kind, event.drive, event.before, event.after] for event in path.events],
        "motion": {name: path.motion(name)[at] for name in names},
        "reaction": {name: path.reaction(name)[at] for name in names},
        "stress": {}, "frequencies": [],
    }  # fmt: skip


def judge(case: Any, seconds: int, tolerance: float) -> tuple[str, str]:
    """Return a verdict and what there is to say."""
    network, drive, control = (from_json(case[part]) for part in ("network", "drive", "control"))
    begun = time.process_time()
    signal.alarm(seconds)
    try:
        path = trace(network, drive, replace(control, tolerance=tolerance or max(case["frozen_at"], 1e-8)))
    except Slow:
        return "slow", ""
    except Exception as error:  # whatever goes wrong is what is looked for
        return "fails", repr(error)
    finally:
        signal.alarm(0)
    spent = f"{time.process_time() - begun:.1f} s"
    expected = {**case["expected"], "stress": {}, "frequencies": []}
    length = path.mesh.scales.length
    seen = observe(path)
    for level in LEVELS:
        wrong = differences(seen, expected, level, length)
        if not wrong:
            honest = "" if path.error > 0.3 * level or level <= 1e-8 else f" TOLD {path.error:.1e}"
            return f"agrees {level:.0e}", f"{spent}{honest}"
    return "differs", f"{spent} {path.message[:80]}: {'; '.join(wrong)[:700]}"


def main() -> None:
    """Judge the cases one by one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="names that contain one of these texts, parted by |")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--tolerance", type=float, default=0.0)
    options = parser.parse_args()

    def stop(*_: Any) -> None:
        raise Slow

    signal.signal(signal.SIGALRM, stop)
    np.seterr(all="ignore")
    count: Counter[str] = Counter()
    for case in [*read_cases()][options.first :: options.every]:
        if any(text in case["name"] for text in options.only.split("|")):
            verdict, text = judge(case, options.seconds, options.tolerance)
            count[verdict] += 1
            print(f"{verdict:14s} {case['name']}  {text}", flush=True)
    print(dict(sorted(count.items())))


if __name__ == "__main__":
    main()
