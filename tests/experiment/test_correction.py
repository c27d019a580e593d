"""Designs corrected by the recordings of parts whose errors are hidden: synthetic loops over all families."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

import cfmkit
from cfmkit import Run
from cfmkit.api import resolve
from cfmkit.errors import DataError
from cfmkit.experiment.reading import Recording
from cfmkit.experiment.redrawn_values import NotMakeable
from cfmkit.families import family

MODULUS = "mechanism.material.youngs_modulus"
LEAVES = ("mechanism.positive.thickness", "mechanism.bistable.thickness")


@dataclass(frozen=True)
class Hidden:
    """A part with errors that only the test knows, and how it is recorded."""

    config: str
    factors: dict = field(default_factory=dict)  # path -> factor
    thicker: float = 0.0  # error of the thickness at `leaves` [m]
    leaves: tuple[str, ...] = ()
    friction: dict = field(default_factory=dict)  # path -> coefficient
    tare: float = 0.0  # reading of the sensor without load [N]
    noise: float = 0.003  # standard deviation over the largest force
    loss: float = 0.0  # half the gap of the branches of a part whose model has no losses, over the force
    seen_at_rest: bool = False  # whether the recording begins without load, for `tare="start"`
    changes: tuple[str, ...] = ()

    @property
    def drawn(self):
        return resolve(cfmkit.load(f"configs/{self.config}.yaml", self.changes))

    def made_of(self, drawn):
        """Return the part that is made of a drawing; its modulus is that of the stock, whatever the drawing states."""
        nominal = self.drawn
        changes = {path: float(drawn.get_value(path)) + self.thicker for path in self.leaves}
        changes |= {
            path: float(nominal.get_value(path)) * factor for path, factor in self.factors.items()
        } | self.friction
        if MODULUS not in changes and "material" in type(nominal.mechanism).model_fields and nominal.mechanism.material:
            changes[MODULUS] = float(nominal.get_value(MODULUS))
        return drawn.replace(changes, as_made=True)

    def recording(self, seed=1):
        curve = curve_of(self.made_of(self.drawn))
        rng, names = np.random.default_rng(seed), curve.branches
        places = np.linspace(*np.sort(curve.motion)[[0, -1]], 400)
        up, down = (at(curve, names[k], places) for k in (0, len(names) - 1))
        known = np.isfinite(up) & np.isfinite(down)
        places, up, down = places[known], up[known] * (1.0 + self.loss), down[known] * (1.0 - self.loss)
        motion = np.tile(np.concatenate([places, places[::-1]]), 2)
        effort = np.tile(np.concatenate([up, down[::-1]]), 2)
        if self.seen_at_rest:
            motion, effort = np.append(np.full(40, motion[0]), motion[1:]), np.append(np.zeros(40), effort[1:])
        noise = rng.normal(0.0, self.noise * np.abs(up).max(), len(effort))
        return Recording("synthetic", motion, effort + self.tare + noise, kind=curve.kind)


def curve_of(part):
    return family(part.family).analyze(part, Run()).curve


def at(curve, branch, places):
    own = curve.select_branch(branch)
    order = np.argsort(own.motion)
    return np.interp(places, own.motion[order], own.effort[order], left=np.nan, right=np.nan)


LOOPS = {
    "finger, soft PLA": Hidden("make_finger", {MODULUS: 0.85}, tare=0.4, loss=0.01),
    "finger, thick leaves": Hidden("make_finger", {}, 0.04e-3, LEAVES, tare=0.4, loss=0.01),
    "finger, stiff and thin": Hidden("make_finger", {MODULUS: 1.1}, -0.05e-3, LEAVES, tare=-0.2, loss=0.01),
    "titanium, thick leaves": Hidden("vcfm_titanium", {}, 0.006e-3, LEAVES, tare=0.02),
    "leaves around bought springs, soft": Hidden("vcfm_bought_springs", {MODULUS: 0.9}, tare=0.2),
    "beams, soft": Hidden("beam_rescaled", {MODULUS: 0.88}, tare=0.1, loss=0.01),
    "beams, thick": Hidden("beam_rescaled", {}, 0.02e-3, ("mechanism.thickness",), tare=0.1, loss=0.01),
    "Lan's beams, stiff": Hidden("beam_lan2010", {MODULUS: 1.12}, tare=-0.1, loss=0.02),
    "cam, stiff springs, friction": Hidden(
        "studies/cam_bought_parts", {"mechanism.springs.stiffness": 1.04}, tare=0.3, noise=0.002,
        friction={"mechanism.rolling_friction": 0.006}, seen_at_rest=True,
    ),
    "published cam, soft springs, friction": Hidden(
        "cam", {"mechanism.springs.stiffness": 0.95}, tare=-0.5, noise=0.002,
        friction={"mechanism.rolling_friction": 0.004}, seen_at_rest=True,
    ),
    "torsion springs, pins that rub": Hidden(
        "slider_crank_bought", {"mechanism.springs.pivot": 1.04}, tare=0.02, seen_at_rest=True,
        friction={"mechanism.pins.friction": 0.05}, changes=("mechanism.pins={diameter: 3 mm, friction: 0.02}",),
    ),
    "strip, soft POM": Hidden("make_pom_strip", {MODULUS: 0.93}, tare=0.02, loss=0.01),
}  # fmt: skip


def corrected_force(name):
    """Return the correction of a hidden part, and the mean force of the part that is made of it [N]."""
    hidden = LOOPS[name]
    found = cfmkit.correct(hidden.drawn, hidden.recording(), tare="start" if hidden.seen_at_rest else None)
    return found, found.aim.mean([curve_of(hidden.made_of(found.corrected))])


def is_close(found, force):
    return abs(force / found.target - 1.0) <= 0.01 or found.after.low <= force <= found.after.high


@pytest.mark.slow
def test_nine_of_ten_corrected_parts_have_the_force_within_one_percent_or_the_interval():
    close = []
    for name in LOOPS:
        found, force = corrected_force(name)
        close.append(is_close(found, force))
        print(
            f"{name:38} target {found.target:8.4g} before {found.before.value:8.4g} corrected {force:8.4g} "
            f"({100 * (force / found.target - 1):+.2f} %) predicted {found.after.low:.4g} to {found.after.high:.4g}"
            f"  {'; or '.join(', '.join(one.sentences) for one in found.explanations)}",
            flush=True,
        )
    assert len(close) >= 10
    assert sum(close) >= 0.9 * len(close)


def test_a_part_that_is_as_its_model_has_nothing_to_correct():
    hidden = Hidden("make_finger", tare=0.3)
    found = cfmkit.correct(hidden.drawn, hidden.recording())
    assert not found.changes
    assert found.corrected == hidden.drawn
    assert found.before.low <= found.aim.mean([curve_of(hidden.drawn)]) <= found.before.high


def test_beams_whose_modulus_is_not_told_from_their_thickness_get_other_widths_alone():
    hidden = LOOPS["beams, soft"]
    found = cfmkit.correct(hidden.drawn, hidden.recording())
    assert {item.path.rpartition(".")[2] for one in found.explanations for item in one.errors} == {
        "youngs_modulus",
        "thickness",
    }
    assert list(found.changes) == ["mechanism.width"]
    assert found.corrected.get_value(MODULUS) == hidden.drawn.get_value(MODULUS)  # said, not guessed
    assert [item.name for item in found.warnings] == ["not_told_apart"]


def test_leaves_that_are_made_too_thick_are_drawn_thinner():
    hidden = LOOPS["titanium, thick leaves"]
    found = cfmkit.correct(hidden.drawn, hidden.recording())
    for path in LEAVES:
        before, after = found.changes[path]
        assert after - before == pytest.approx(-hidden.thicker, rel=0.03)


def test_springs_and_friction_of_a_cam_stay_and_its_profile_changes():
    hidden = LOOPS["published cam, soft springs, friction"]
    found = cfmkit.correct(hidden.drawn, hidden.recording(), tare="start")
    assert list(found.changes) == ["mechanism.profile.force_constant"]
    before, after = found.changes["mechanism.profile.force_constant"]
    assert after / before == pytest.approx(1.0 / 0.95, rel=0.005)
    for path in ("mechanism.springs.stiffness", "mechanism.rolling_friction"):
        assert found.corrected.get_value(path) == hidden.drawn.get_value(path)


def test_links_are_found_beyond_the_offset_at_which_the_force_jumps():
    """With the crank and the offset shorter by 1.5 % the force is smooth; between there and the drawing it is not."""
    springs = {"mechanism.springs.pivot": 0.974, "mechanism.springs.slider_pin": 0.969}
    pins = "mechanism.pins={diameter: 3 mm, friction: 0.02}"
    friction = {"mechanism.pins.friction": 0.1}
    hidden = Hidden("slider_crank_bought", springs, friction=friction, seen_at_rest=True, changes=(pins,))
    found = cfmkit.correct(hidden.drawn, hidden.recording(), tare="start")
    assert is_close(found, found.aim.mean([curve_of(hidden.made_of(found.corrected))]))


def test_a_part_stays_in_the_envelope_that_is_required():
    """Widths alone would make it 15.2 mm deep."""
    hidden = Hidden("make_finger", {MODULUS: 0.85}, changes=("requirements.0={metric: envelope_z, max: 13.5 mm}",))
    found = cfmkit.correct(hidden.drawn, hidden.recording())
    result = cfmkit.analyze(found.predicted.spec)
    (depth,) = (one for one in result.requirements if one.metric == "envelope_z")
    assert depth.ok
    assert any(path.endswith("thickness") for path in found.changes)
    assert found.after.value == pytest.approx(found.target, rel=0.01)


def test_a_recording_of_another_travel_is_refused():
    hidden = Hidden("make_finger")
    recording = hidden.recording()
    longer = Recording("long", 3.0 * recording.motion, recording.effort)
    with pytest.raises(DataError, match=r"goes over .* a recording of another part\?"):
        cfmkit.correct(hidden.drawn, longer)


def test_a_recording_of_another_force_is_refused():
    hidden = Hidden("make_finger")
    recording = hidden.recording()
    with pytest.raises(DataError, match="a recording of another part"):
        cfmkit.correct(hidden.drawn, Recording("strong", recording.motion, 30.0 * recording.effort))


def test_a_zero_that_is_larger_than_the_force_is_no_zero():
    """The force of these springs is constant: 8 times as much of it looks like a zero of 7 times the force."""
    drawn = Hidden("slider_crank_bought").drawn
    curve, noise = curve_of(drawn), np.random.default_rng(3)
    motion, effort = (np.concatenate([values, values[::-1]]) for values in (curve.motion, 8.0 * curve.effort))
    strong = Recording("strong", motion, effort + noise.normal(0.0, 0.03, len(motion)))
    with pytest.raises(DataError, match=r"without load the sensor would show .* another part"):
        cfmkit.correct(drawn, strong)


def test_a_thickness_that_the_process_cannot_make_is_refused_with_the_nearest_force():
    """The width is that of the sheet: a stiffer material needs beams thinner than 0.98 mm, the least that is made."""
    changes = ("mechanism.part.sheet=10 mm", "mechanism.part.process.least_feature=0.98 mm")
    hidden = Hidden("beam_rescaled", {MODULUS: 1.4}, changes=changes)
    with pytest.raises(NotMakeable, match=r"no part that can be made has .*: the nearest has") as caught:
        cfmkit.correct(hidden.drawn, hidden.recording())
    assert "0.98 mm" in str(caught.value)
