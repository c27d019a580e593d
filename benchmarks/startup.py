"""What a user waits for: whole processes, beside what the libraries alone cost to import.

Each command runs several times, interleaved with the others, and its best time counts.
Ratios are against an interpreter that only imports numpy (or numpy and matplotlib where
pictures are drawn), measured in the same run: the machine's mood cancels.

Last, what it takes to list the families among 500 other installed packages (goal: 20 ms), beside what
importlib.metadata takes to look through the same folder.

Run: python benchmarks/startup.py
"""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CFMKIT = str(Path(sys.executable).with_name("cfmkit"))
CONFIG = str(Path(__file__).resolve().parent.parent / "configs" / "cam.yaml")
ROUNDS = 7

PEERS = {
    "import numpy": [sys.executable, "-c", "import numpy"],
    "import numpy, matplotlib's Agg": [
        sys.executable,
        "-c",
        "import numpy, matplotlib.figure, matplotlib.backends.backend_agg",
    ],
}
COMMANDS = {
    # name: (arguments, limit of the project's goals [s], peer)
    "--help": (["--help"], 0.3, "import numpy"),
    "check": (["check", CONFIG], 0.8, "import numpy"),
    "analyze --no-plots": (["analyze", CONFIG, "--no-plots", "-q", "-o", "a"], 1.0, "import numpy"),
    "analyze": (["analyze", CONFIG, "-q", "-o", "b"], 2.5, "import numpy, matplotlib's Agg"),
    "design": (["design", CONFIG, "-q", "-o", "c"], None, "import numpy, matplotlib's Agg"),
    "measure, 100 000 rows": (["measure", "loop.csv", "-q", "-o", "d"], 2.0, "import numpy, matplotlib's Agg"),
}


def write_loop(path: Path, rows: int = 100_000) -> None:
    """Write a synthetic recording, 0 to 240 mm and back, with the German signs of a lab: time, travel, force."""
    half = rows // 2
    lines = ["t [s];s [mm];F [N]"]
    for number in range(rows):
        travel = 240.0 * (number + 1 if number < half else rows - number) / half
        force = 50.0 + 0.4 * math.sin(travel / 5.0) + (0.3 + 0.003 * travel) * (1.0 if number < half else -1.0)
        lines.append(f"{0.001 * number:.3f};{travel:.4f};{force:.4f}".replace(".", ","))
    path.write_text("\n".join(lines) + "\n")


def best_times(folder: str) -> dict[str, float]:
    """Return the best wall time of each peer and command [s], measured in turn."""
    calls = PEERS | {name: [CFMKIT, *arguments] for name, (arguments, _, _) in COMMANDS.items()}
    best = dict.fromkeys(calls, float("inf"))
    for _ in range(ROUNDS):
        for name, call in calls.items():
            start = time.perf_counter()
            subprocess.run(call, cwd=folder, check=True, capture_output=True)
            best[name] = min(best[name], time.perf_counter() - start)
    return best


LISTING = """
import sys, time
sys.path.insert(0, sys.argv[1])
import cfmkit.families
best = 1.0
for _ in range(5):
    cfmkit.families.entry_point_plugins._offers_on.cache_clear()
    began = time.process_time()
    cfmkit.families.names()
    best = min(best, time.process_time() - began)
import importlib.metadata
peer = 1.0
for _ in range(5):
    importlib.metadata.FastPath.__new__.cache_clear()
    began = time.process_time()
    importlib.metadata.entry_points(group="cfmkit.families")
    peer = min(peer, time.process_time() - began)
print(best, peer)
"""


def listing(folder: Path) -> tuple[float, float]:
    """Return the processor time to list families among 500 packages [s], and that of importlib.metadata."""
    for number in range(500):
        info = folder / f"package_{number}-1.0.dist-info"
        info.mkdir()
        (info / "entry_points.txt").write_text("[console_scripts]\nprogram = module:function\n")
    done = subprocess.run([sys.executable, "-c", LISTING, str(folder)], capture_output=True, text=True, check=True)
    own, peer = map(float, done.stdout.split())
    return own, peer


def main() -> None:
    """Print one line per command."""
    with tempfile.TemporaryDirectory() as folder:
        write_loop(Path(folder) / "loop.csv")
        best = best_times(folder)
    for name in PEERS:
        print(f"{name:32s} {best[name]:6.2f} s")
    for name, (_, limit, peer) in COMMANDS.items():
        goal = f"goal {limit:.1f} s" if limit else ""
        print(f"cfmkit {name:25s} {best[name]:6.2f} s   {best[name] / best[peer]:5.1f} x {peer}   {goal}")
    with tempfile.TemporaryDirectory() as folder:
        own, other = listing(Path(folder))
    print(f"families among 500 packages {1e3 * own:8.1f} ms   {own / other:5.2f} x importlib.metadata   goal 20 ms")


if __name__ == "__main__":
    main()
