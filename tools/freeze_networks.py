"""Write anew what is known of the paths of `tests/cases/networks.jsonl`.

    python tools/freeze_networks.py [--only TEXT] [--add CASES.jsonl]

Every network is followed at a tolerance of 1e-9, and the values that `tests/support/network_cases.py` takes of its
path replace those of the file. The values are the judge of changes to the beam engine: write them only where the
mechanics is known to be right, and say in the commit which changed and why. `--add` takes further cases: lines with
name, network, drive and control. A path that does not reach 1e-9 is kept with the tolerance that it reaches, at most
1e-6; else the case is refused.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))
from network_cases import FILE, from_json, observe, read_cases, rounded

from cfmkit.elastica import trace
from cfmkit.errors import InputError

TOLERANCES = (1e-9, 1e-8, 1e-7, 1e-6)


def freeze(case: dict[str, Any]) -> dict[str, Any] | None:
    """Return a case with the values of its path, or None if no tolerance is reached."""
    network, drive, control = (from_json(case[name]) for name in ("network", "drive", "control"))
    for tolerance in TOLERANCES:
        path = trace(network, drive, replace(control, tolerance=tolerance))
        if path.status.name != "INACCURATE":
            return {**case, "frozen_at": tolerance, "expected": rounded(observe(path))}
    return None


def main() -> None:
    """Write the file anew, case by case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="names that contain this text")
    parser.add_argument("--add", type=Path, help="further cases")
    options = parser.parse_args()
    cases = list(read_cases()) if FILE.exists() else []
    known = {case["name"] for case in cases}
    if options.add:
        added = (json.loads(line) for line in options.add.read_text(encoding="utf-8").splitlines())
        cases += [case for case in added if case["name"] not in known]
    lines = []
    for case in cases:
        if options.only in case["name"] and (options.add is None or case["name"] not in known):
            try:
                frozen = freeze(case)
            except InputError as error:
                print(f"{case['name']}: {error}", file=sys.stderr)
                continue
            if frozen is None:
                print(f"{case['name']}: no tolerance is reached", file=sys.stderr)
                continue
            case = frozen
            print(case["name"], flush=True)
        lines.append(json.dumps(case, separators=(",", ":")))
    FILE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
