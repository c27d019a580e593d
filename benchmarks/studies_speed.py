"""What a study costs beside its points: run ``python benchmarks/studies_speed.py`` on a quiet machine.

Four questions: what journal and rows add to a single point (at most 50 us), what a
second process brings for points of 10 ms (at least 1.7 times), and what a million
points of a closed form, of a cam and of a slider-crank, take with 12 metrics (at most
40 s on two cores, and 300 MB beyond the bare process); what a made part of Lan's beams
costs that is judged for a yield (at most 12.5 ms).
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import cfmkit
from cfmkit.families.run_control import Run
from cfmkit.results import Status
from cfmkit.studies.engine import Work, run
from cfmkit.studies.journal import Journal
from cfmkit.studies.parts.drawn_parts import analyze_parts
from cfmkit.studies.parts.parts import Parts
from cfmkit.studies.plan import grid
from cfmkit.studies.point_evaluation import Metric, Row, Study
from cfmkit.studies.pool import Pool
from cfmkit.studies.sweep_request_and_files import outputs, summary_of
from cfmkit.studies.variations import axes, parse_variation

ROOT = Path(__file__).parents[1]
SPEC = cfmkit.load(ROOT / "configs" / "cam.yaml").replace({"requirements": ()})
TWELVE = (
    "force_mean,force_sd,force_max,force_min,force_ripple,half_band,deviation_from_mean,hysteresis_area,"
    "theoretical_force,roller_radius_max,spring_elongation_max,brace_angle_max"
)
TWELVE_TORQUES = (
    "torque_mean,torque_sd,torque_max,torque_min,torque_ripple,half_band,deviation_from_mean,"
    "stiffness_class,stiffness_drop,stable_positions,unstable_positions,constant_angle"
)


class Free(Study):
    """A study whose points cost nothing: what is left is the overhead."""

    def evaluate(self, values):
        return Row(Status.COMPLETE, tuple(float(values[0]) / k for k in range(1, 13)), ())


class TenMilliseconds(Study):
    """A study whose points take 10 ms of a processor."""

    def evaluate(self, values):
        end = time.process_time() + 0.01
        while time.process_time() < end:
            pass
        return Row(Status.COMPLETE, (float(values[0]),), ())


def work(kind: type[Study], count: int, metrics: int) -> Work:
    plan = grid(axes(SPEC, [parse_variation(f"mechanism.profile.friction=0:0.002:{count}")]))
    return Work(kind(SPEC, plan.paths, tuple(Metric(f"m{k}", "force") for k in range(metrics))), plan)


def overhead(count: int = 20_000) -> None:
    many = work(Free, count, 12)
    with tempfile.TemporaryDirectory() as folder, Journal(Path(folder) / "journal") as journal:
        start = time.process_time()
        records = run(many, journal=journal)
        written = b"".join(dict(outputs(records, summary_of(records)))["results.csv"])
        seconds = time.process_time() - start
    assert written.count(b"\n") == count + 1
    print(f"overhead a point         {1e6 * seconds / count:.1f} us   (allowed 50)")


def two_processes(count: int = 400) -> None:
    many = work(TenMilliseconds, count, 1)
    took = []
    for processes in (1, 2):
        start = time.perf_counter()
        run(many, Pool(processes))
        took.append(time.perf_counter() - start)
    print(f"two processes            {took[0] / took[1]:.2f} times one   (wanted 1.7)")


MILLIONS = {
    "cam.yaml": (
        "--vary", "mechanism.roller_radius=6 mm:10 mm:1000",
        "--vary", "mechanism.springs.stiffness=0.4 N/mm:1 N/mm:1000", "--metrics", TWELVE,
    ),
    "slider_crank_li2019.yaml": (
        "--vary", "mechanism.springs.slider_pin=0.3 N*cm/deg:0.9 N*cm/deg:1000",
        "--vary", "mechanism.springs.slider=0.5 N/cm:2 N/cm:1000", "--metrics", TWELVE_TORQUES,
    ),
}  # fmt: skip


def processor() -> float:
    """Return what processes started here have used, those that they started included [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def million(name: str) -> None:
    command = [
        Path(sys.executable).parent / "cfmkit", "sweep", ROOT / "configs" / name, "--set", "requirements=[]",
        "--set", "analysis.points=101", *MILLIONS[name], "--no-plots", "-q", "-j", "2",
    ]  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        start, before = time.perf_counter(), processor()
        subprocess.run([*command, "-o", f"{folder}/out"], check=True)
        seconds, worked = time.perf_counter() - start, processor() - before
        size = os.path.getsize(f"{folder}/out/results.csv")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    bare = "import cfmkit.studies.sweep_request_and_files, cfmkit.families.cam, resource as r;"
    bare += "print(r.getrusage(r.RUSAGE_SELF).ru_maxrss)"
    base = int(subprocess.run([sys.executable, "-c", bare], capture_output=True, check=True).stdout) / 1024
    print(f"a million points         {name}: {seconds:.1f} s, {size / 1e6:.0f} MB of CSV   (allowed 40 s)")
    print(f"  of a processor         {worked:.1f} s")
    print(f"  largest process        {peak:.0f} MB, {peak - base:.0f} MB beyond a bare one   (allowed 300)")


def main() -> None:
    print(f"numpy {np.__version__}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    overhead()
    two_processes()
    made_parts()
    for name in MILLIONS:
        million(name)


def made_parts(count: int = 192) -> None:
    """Judge parts of the beams of Lan as a yield does: half band, largest stress, mean force."""
    spec = cfmkit.load(ROOT / "configs" / "studies" / "beam_lan2010_yield.yaml")
    nominal, made = cfmkit.analyze(spec), Parts.from_design(spec, spec.design, 0)
    values = made.draw(count, 5)
    start = time.process_time()
    analyze_parts(made, values, nominal, Run())
    print(f"a made part of Lan's     {1e3 * (time.process_time() - start) / count:.1f} ms   (allowed 12.5)")


if __name__ == "__main__":
    # Workers import the classes above by the name of their module.
    import studies_speed

    studies_speed.main()
