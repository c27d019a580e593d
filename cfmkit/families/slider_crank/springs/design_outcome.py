"""Outcome of a design of springs: the springs, their audit by the analysis, and sentences; or why there are none."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from cfmkit.designing.rounded_and_reported_values import measure_metrics, search_values
from cfmkit.families.findings import percent
from cfmkit.families.run_control import Run
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.springs.model import analyze
from cfmkit.families.slider_crank.springs.rate_fit_task import FREE_LENGTH_KEYS
from cfmkit.families.slider_crank.springs.rates_for_widest_window import widest
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, JOINTS_BY_NAME
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import CrankDesign, SliderCrankSpec
    from cfmkit.families.slider_crank.springs.bought_springs import SpringOption
    from cfmkit.families.slider_crank.springs.rate_fit_task import SpringTask
    from cfmkit.results import Finding, Searched


@dataclass(frozen=True)
class ChosenSprings:
    """A design that was found."""

    task: SpringTask  # with the lengths chosen
    window: tuple[float, float]  # where the target is kept [rad or m]
    rates: FloatArray  # (4,) of the springs of one leg [N m/rad; the last N/m]
    # deviation, rms: largest and root mean square deviation, as fractions of the target
    deviation: float
    rms: float
    proven: bool = True  # of a widest window: whether all others were ruled out
    places: int = 0  # at so many of the window the deviations were looked at
    exact: bool = False  # whether deviation and rms are those that the analysis of the design measures
    bought: tuple[SpringOption, ...] = ()  # springs of a catalogue; none where any rate may be had

    @property
    def judged(self) -> tuple[float, float]:
        """Places of deviations [rad or m]: the window, its start left out where the force begins there."""
        places = self.task.places(self.window, self.places or None)
        return float(places[0]), float(places[-1])


def audit(solved: ChosenSprings, spec: SliderCrankSpec) -> ChosenSprings:
    """Return a design with the deviations that the analysis of its specification measures.

    Those from a line that is not level are none of its metrics: they stay what the search found at its places.
    """
    if solved.task.wanted.stiffness is not None:
        return solved
    result, target, followed = analyze(spec, Run()), abs(solved.task.wanted.size), solved.task.wanted.curve is not None
    if not result.curves or not (result.target or followed):
        return solved
    names = ("deviation_from_curve", "rms_to_curve") if followed else ("deviation_from_target", "rms_to_target")
    branch = ""
    if solved.task.assembly.rubbing.is_present:
        branch = solved.task.wanted.branch or "mean"
        if branch == "mean":  # no way of the curve is the mean of both
            return solved
        branch = f"[{branch}]"
    (largest,) = measure_metrics(result, solved.judged, f"{names[0]}{branch}")
    (rms,) = measure_metrics(result, solved.window, f"{names[1]}{branch}")
    if largest is None or rms is None:
        return solved
    return replace(solved, deviation=largest, rms=rms / target, exact=True)


def _infeasible_targets(text: str) -> Finding:
    return finding("infeasible_targets", text)


def check_reach(task: SpringTask, window: tuple[float, float]) -> None:
    """Refuse a window that linkage or joint limits do not allow."""
    first, last = task.allowed
    slack = 1e-9 * (window[1] - window[0])
    if window[0] >= first - slack and window[1] <= last + slack:
        return
    ends = [format_short(end, task.assembly.dimension) for end in (*window, first, last)]
    raise finding.infeasible(
        "infeasible_targets",
        f"the window {ends[0]} to {ends[1]} is not reached: linkage and limits of the joints allow {ends[2]} to "
        f"{ends[3]}; change 'design.{task.assembly.motion_name}', the lengths, or 'mechanism.limits'",
    )


def explain_impossible_slope(task: SpringTask) -> Finding:
    """Return why a slope in the stretched position, or a trim, cannot be had."""
    wanted = task.wanted
    if wanted.angle_travel is not None and not wanted.hold_stiffness:
        return _infeasible_targets(
            f"no springs give an adjustment of {format_short(wanted.adjustment or 0.0, 'force')} when the unloaded "
            f"angle is turned by {format_short(wanted.angle_travel, 'angle')}, within 'design.max_rates'; reduce "
            "'design.adjustment', or increase 'design.angle_travel'"
        )
    text = "no springs with rates of zero or more have 'design.stiffness' in the stretched position within "
    text += "'design.max_rates'"
    if task.assembly.stretched_motion == task.assembly.start:
        text += ": the springs are relaxed there, and only positive slopes exist"
    elif (
        task.goal((task.assembly.start, task.assembly.stretched_motion)) is not None and "slider" not in wanted.springs
    ):
        text += ": torsion springs alone have positive slopes; use the spring at the slider"
    return finding("no_zero_stiffness", text)


def explain_no_window(task: SpringTask) -> Finding:
    """Return why no window keeps the tolerance, or why no springs are better than none in the window."""
    window, drive = task.wanted.window, task.assembly.drive
    goal = task.goal(window) if window is not None else None
    if task.wanted.curve is not None:
        return _infeasible_targets(
            "no springs come closer to 'design.target' than having none at all; change it, its window, or "
            "'design.springs'"
        )
    if goal is not None and drive == "torque" and (goal.matrix[:, :3] <= 0.0).all():
        text = "in the window torsion springs turn the crank the other way; request 'design.torque: "
        return _infeasible_targets(f"{text}{format_short(-task.wanted.size, 'torque')}'")
    if "slider" not in task.wanted.springs and drive == "torque":
        text = "torsion springs alone give no constant torque next to the stretched position"
        return finding("no_zero_stiffness", f"{text}; use the slider's, too, in 'design.springs'")
    if window is not None:
        text = f"in the window no springs come closer to a constant {drive} than having none at all"
        return _infeasible_targets(f"{text}; change 'design.{task.assembly.motion_name}' or 'design.springs'")
    return _infeasible_targets("no window keeps 'design.tolerance'; allow more, or change the lengths in 'mechanism'")


def explain_hopeless(task: SpringTask, deviation: float) -> Finding:
    """Return that even the best springs have nothing of a constant effort, and why."""
    assembly, text = task.assembly, f"even the best springs are off by {percent(deviation)}"
    if task.wanted.curve is not None:
        cure = "change it, its window, or the lengths in 'mechanism'"
        return _infeasible_targets(f"{text} of the largest of 'design.target'; {cure}")
    text += f": that is no constant {assembly.drive}"
    if assembly.drive == "torque" and (assembly.stretched_motion - assembly.start) * task.wanted.size <= 0.0:
        text += "; the stretched position does not lie ahead of the unloaded one, and the torque only rises there; "
        text += "change 'mechanism.unloaded_angle' (or 'unloaded_offset'), or the sign of 'design.torque'"
        return finding("no_zero_stiffness", text)
    return _infeasible_targets(f"{text}; narrow 'design.{assembly.motion_name}', or change the lengths in 'mechanism'")


def explain_too_wide(task: SpringTask, deviation: float) -> tuple[Finding, dict[str, str]]:
    """Return that a window is too wide for its tolerance, and what would be feasible."""
    tolerance, name = task.wanted.tolerance or 0.0, f"design.{task.assembly.motion_name}"
    nearest = {"design.tolerance": f"{100 * deviation:.4g} %"}
    text = f"the best springs are off by {percent(deviation)}, and 'design.tolerance' allows {percent(tolerance)}"
    text += f"; allow more, or narrow '{name}'"
    if (widest_window := widest(task, tolerance)) is not None:
        low, high = (format_short(end, task.assembly.dimension) for end in (widest_window.low, widest_window.high))
        nearest[name] = f"[{low}, {high}]"
        text += f": a window that keeps it is {low} to {high}"
    return _infeasible_targets(text), nearest


def active_bounds(solved: ChosenSprings, wanted: CrankDesign) -> tuple[str, ...]:
    """Return the paths of the design whose limit is reached."""
    active = []
    for name in FREE_LENGTH_KEYS:
        ends = getattr(wanted, name)
        if ends is not None and getattr(solved.task.spec.mechanism, name) in ends:
            active.append(f"design.{name}")
    for name, rate in zip(JOINT_NAMES, solved.rates.tolist(), strict=True):
        cap = None if wanted.max_rates is None else getattr(wanted.max_rates, name)
        if cap and rate >= cap * (1 - 1e-9):
            active.append(f"design.max_rates.{name}")
    return tuple(active)


def describe_springs(solved: ChosenSprings) -> tuple[Finding, ...]:
    """Return what to say about springs that are not needed, and about those that would like to be stiffer."""
    if solved.bought:
        return ()  # which joint gets none is the choice of the catalogue's springs
    warnings, wanted = [], solved.task.wanted
    rates = zip(JOINT_NAMES, solved.rates, strict=True)
    gone = [JOINTS_BY_NAME[name].words for name, rate in rates if rate == 0.0 and name in wanted.springs]
    if gone:
        text = f"the best rate at {' and '.join(gone)} is zero: no spring is needed there"
        warnings.append(finding("spring_dropped", text))
    at_cap = [path for path in active_bounds(solved, wanted) if "max_rates" in path]
    if at_cap:
        text = f"{' and '.join(at_cap)} limits the design: a larger value would give a better one"
        warnings.append(finding("spring_at_bound", text))
    return tuple(warnings)


def warn_not_proven(solved: ChosenSprings, of_lengths: bool) -> Finding:
    """Return what to say about a widest window that may not be the widest of all."""
    low, high = (_place_text(solved, end) for end in solved.window)
    if of_lengths:
        text = "is the widest window for the lengths chosen, which a local search compared: others may have wider ones"
    else:
        name = f"'design.{solved.task.assembly.motion_name}_within'"
        text = f"is the widest window found, and the search of the whole motion was cut short; {name} narrows it"
    return finding("window_not_proven", f"{low} to {high} {text}")


def _place_text(solved: ChosenSprings, motion: float) -> str:
    return format_short(motion, solved.task.assembly.dimension)


def message(solved: ChosenSprings) -> str:
    """Return the outcome in one sentence."""
    rms = f"rms {percent(solved.rms)}"
    if solved.exact:
        low, high = (_place_text(solved, end) for end in solved.judged)
        return f"off by at most {percent(solved.deviation)} ({rms}) over {low} to {high}"
    low, high = (_place_text(solved, end) for end in solved.window)
    return f"off by at most {percent(solved.deviation)} ({rms}) at {solved.places} places of {low} to {high}"


def search_of(solved: ChosenSprings) -> dict[str, Searched]:
    """Return what only the search knows: how far the springs are off a line at the places that it looked at.

    From a level line they are off by what the analysis measures, as ``deviation_from_target`` and ``rms_to_target``.
    """
    if solved.exact:
        return {}
    places = f"deviation from the target, relative to it, at the {solved.places} places searched"
    about: dict[str, tuple[float | None, str, str]] = {
        "largest_miss": (solved.deviation, "ratio", f"largest {places}"),
        "mean_square_miss": (solved.rms, "ratio", f"root mean square {places}"),
    }
    return search_values(about, "prb", solved.window, solved.task.assembly.dimension)
