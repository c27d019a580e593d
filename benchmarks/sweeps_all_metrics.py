"""Sweeps with all default metrics: run ``python benchmarks/sweeps_all_metrics.py`` on a quiet machine.

For each family, rows a second of processor time with the family's block model (where it applies) and point by
point. ``--against PYTHON`` runs the same sweeps with the interpreter of another checkout, in turn with this one, and
prints how many times as long a sweep takes here; ``--configs DIR`` has specifications that both know.

``--memory`` prints the peak memory of a sweep of cams by its number of rows, with one job and with two, side by side.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve()

SWEEPS = {
    "cam": ("cam.yaml", "mechanism.roller_radius=6 mm:10 mm:20", "mechanism.springs.stiffness=0.4 N/mm:1 N/mm:20"),
    "cam, many": (
        "cam.yaml", "mechanism.roller_radius=6 mm:10 mm:60",
        "mechanism.springs.stiffness=0.4 N/mm:1 N/mm:60",
    ),
    "vcfm": (
        "vcfm_ding2022.yaml", "mechanism.bistable.thickness=0.4 mm:0.6 mm:10",
        "mechanism.positive.thickness=0.8 mm:1 mm:10",
    ),
    "slider-crank, torque": (
        "slider_crank_li2019.yaml", "mechanism.springs.slider_pin=0.3 N*cm/deg:0.9 N*cm/deg:10",
        "mechanism.springs.slider=0.5 N/cm:2 N/cm:10",
    ),
    "slider-crank, force": (
        "slider_crank_bilancia2019.yaml", "mechanism.springs.crank_pin=0.3 N*cm/deg:0.9 N*cm/deg:10",
        "mechanism.springs.slider_pin=0.01 N*cm/deg:0.02 N*cm/deg:10",
    ),
}  # fmt: skip
ROUNDS = 3


def measured(name: str, configs: Path, singly: bool) -> tuple[float, int, bool]:
    """Return processor time of a sweep [s], its rows, and whether blocks were used."""
    import cfmkit
    from cfmkit.studies import engine, sweep_request_and_files
    from cfmkit.studies.variations import parse_variation

    file, *vary = SWEEPS[name]
    module = sweep_request_and_files
    request = getattr(module, "SweepRequest", None) or module.Request  # as older checkouts call it
    work = module.prepare(cfmkit.load(configs / file), request(vary=tuple(parse_variation(one) for one in vary)))
    if singly:
        engine.vectorised = lambda *_: False
    start = time.process_time()
    records = engine.run(work)
    b"".join(dict(sweep_request_and_files.outputs(records, sweep_request_and_files.summary_of(records)))["results.csv"])
    return time.process_time() - start, len(work.plan), work.vectorised


def child(python: str, name: str, configs: Path, singly: bool) -> tuple[float, int, bool]:
    """Return `measured` by a process of its own: the shorter of two runs, the first of which also imports."""
    request = json.dumps([name, str(configs), singly])
    reported = subprocess.run([python, HERE, "--one", request], capture_output=True, text=True, check=True).stdout
    seconds, rows, blocks = json.loads(reported)
    return seconds, rows, blocks


ROWS = (5_000, 20_000)


def peak_memory(jobs: int, rows: int, configs: Path) -> tuple[float, float]:
    """Return the peak memory of ``cfmkit sweep`` [MB]: of the process itself, and of the largest worker."""
    vary = ("mechanism.roller_radius=6 mm:10 mm:50", f"mechanism.springs.stiffness=0.4 N/mm:1 N/mm:{rows // 50}")
    code = (
        "import resource, sys; from cfmkit.cli.main import entry; code = entry(); "
        "print(code, *(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))"
    )
    with tempfile.TemporaryDirectory() as out:
        options = ["-j", str(jobs), "-o", os.path.join(out, "sweep"), "--no-plots", "-q"]
        command = [sys.executable, "-c", code, "sweep", str(configs / "cam.yaml"), *options]
        command += [word for one in vary for word in ("--vary", one)]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    code_, own, worker = map(int, re.findall(r"[0-9]+", said)[-3:])
    assert code_ in (0, 6), said
    return own / 1024, worker / 1024


def print_memory(configs: Path) -> None:
    """Print the peak memory of sweeps, and what each row adds."""
    print(f"{'rows':>8}{'-j 1':>12}{'-j 2':>12}{'its workers':>14}   [MB]")
    found = []
    for rows in ROWS:
        (alone, _), (parent, worker) = (peak_memory(jobs, rows, configs) for jobs in (1, 2))
        found.append((alone, parent, worker))
        print(f"{rows:>8}{alone:>12.0f}{parent:>12.0f}{worker:>14.0f}", flush=True)
    added = [1024 * (b - a) / (ROWS[1] - ROWS[0]) for a, b in zip(*found, strict=True)]
    print(f"{'kB a row':>8}{added[0]:>12.2f}{added[1]:>12.2f}{added[2]:>14.2f}")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("--against", metavar="PYTHON", help="interpreter of another checkout")
    parser.add_argument("--configs", type=Path, default=HERE.parents[1] / "configs")
    parser.add_argument("--memory", action="store_true", help="peak memory with one job and with two")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.memory:
        print_memory(given.configs)
        return
    if given.one:
        name, configs, singly = json.loads(given.one)
        print(json.dumps(min(measured(name, Path(configs), singly) for _ in range(2))))
        return
    print(f"{'sweep':<24}{'rows':>6}{'block':>14}{'singly':>14}{'against':>10}")
    for name in SWEEPS:
        here, there = [], []
        for _ in range(ROUNDS):
            here.append(child(sys.executable, name, given.configs, False))
            if given.against:
                there.append(child(given.against, name, given.configs, False))
        alone = child(sys.executable, name, given.configs, True)
        seconds, rows, blocks = min(here)
        block = f"{rows / seconds:.0f} rows/s" if blocks else "none"
        ratio = f"{seconds / min(there)[0]:.2f}" if there else ""
        print(f"{name:<24}{rows:>6}{block:>14}{rows / alone[0]:>7.0f} rows/s{ratio:>10}", flush=True)


if __name__ == "__main__":
    main()
