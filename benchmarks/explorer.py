"""What a slider of `cfmkit explore` waits for: the answer of a closed model, beside the analysis alone.

Each answer is of another value, so that nothing is reused; processor time, least of some rounds. The peer, in turns in
the same run, is `cfmkit.analyze` of the same specification: what is left is reading the change, metrics, requirements
and the points that the page draws.

Run: python benchmarks/explorer.py
"""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import cfmkit
from cfmkit.runs.explorer_server import Explorer

if TYPE_CHECKING:
    from collections.abc import Callable

CONFIGS = Path(__file__).resolve().parent.parent / "configs"
SLIDERS = {
    "cam": "mechanism.springs.stiffness=0.6{} N/mm",
    "slider_crank_li2019": "mechanism.crank_length=100.{} mm",
    "vcfm_ding2022": "mechanism.positive.length=25.{} mm",
}
ROUNDS = 30
WANTED = 0.1  # s, of the project's goals


def taken(task: Callable[[], object]) -> float:
    """Return the processor time of a task [s]."""
    start = time.process_time()
    task()
    return time.process_time() - start


def main() -> None:
    """Print a row a family."""
    print(f"{'config':<22} {'answer':>9} {'analysis':>9} {'ratio':>6} {'wanted':>8}")
    for name, change in SLIDERS.items():
        explorer = Explorer.from_file(str(CONFIGS / f"{name}.yaml"))
        answers, analyses = [], []
        for number in range(10, 10 + ROUNDS):
            changes = [change.format(number)]
            spec = explorer.spec(changes)
            answers.append(taken(partial(explorer.answer, changes)))
            analyses.append(taken(partial(cfmkit.analyze, spec)))
        answer, analysis = min(answers), min(analyses)
        cells = f"{1e3 * answer:>6.1f} ms {1e3 * analysis:>6.1f} ms {answer / analysis:>6.2f} {1e3 * WANTED:>5.0f} ms"
        print(f"{name:<22} {cells}")


if __name__ == "__main__":
    main()
