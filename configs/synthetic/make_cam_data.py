"""Makes the data of configs/cam_as_built.yaml: nothing in this folder was measured.

- cam_flanks.csv: points every half millimetre of height on the lower 150 mm of both flanks of the published cam. Each
  flank has 0.0155 mm too much material and six waves of 30 to 150 mm with 0.017 mm standard deviation together: sizes
  as Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819, sec. 2.3 found them on theirs. To this comes noise of
  the measurement, 0.002 mm, and the part lies askew: 0.3 deg, 1.5 and -0.8 mm.
- cam_loop.csv: the force on that cam, 5 to 130 mm and back at 500 mm/min, 35 values per second, with a rolling friction
  of 0.00225, springs 0.3 mm longer than the cam was cut for (0.15 mm on each side), and 0.05 N of noise.

Run: python configs/synthetic/make_cam_data.py [FOLDER]      (default: this folder; same versions, same bytes)
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import cfmkit
from cfmkit.families.cam.geometry.flank_from_roller_path import DesignFlank, arc_lengths
from cfmkit.families.cam.mechanism_from_spec import assemble
from cfmkit.numerics.rigid_point_registration import turn_points

HERE = Path(__file__).resolve().parent
WIDER, WAVES, NOISE = 15.5e-6, 17e-6, 2e-6
LENGTHS = np.array([30e-3, 38e-3, 50e-3, 67e-3, 95e-3, 150e-3])
ASKEW = np.radians(0.3), np.array([1.5e-3, -0.8e-3])
FRICTION, LONGER, FORCE_NOISE = 0.00225, 0.15e-3, 0.05
SPEED, RATE = 500e-3 / 60.0, 35.0


def flank(design: DesignFlank, rng: np.random.Generator) -> np.ndarray:
    """Return the points of one flank as a machine would record them (n, 2) [m]."""
    dense = np.linspace(*design.ends, 40_001)
    heights = design.frame(dense).points[:, 1]
    parameter = np.interp(np.arange(15.5e-3, 165.25e-3, 0.5e-3), heights, dense)
    at, along = design.frame(parameter), np.interp(parameter, *arc_lengths(design))
    phases = rng.uniform(0.0, 2.0 * np.pi, len(LENGTHS))
    waves = np.cos(2.0 * np.pi * along[:, None] / LENGTHS + phases).sum(axis=1)
    error = WIDER + WAVES * (2.0 / len(LENGTHS)) ** 0.5 * waves
    noise = rng.normal(0.0, NOISE, (len(along), 2))
    return turn_points(at.points + error[:, None] * at.normals + noise, *ASKEW)


def flanks_csv(profile) -> str:
    """Return the file with the points of both flanks."""
    rng = np.random.default_rng(2022)
    lines = ["synthetic: made by configs/synthetic/make_cam_data.py, not measured", "side;x [mm];y [mm]"]
    for side, hand in (("right", 1.0), ("left", -1.0)):
        points = flank(DesignFlank(profile, hand), rng)
        lines += [f"{side};{1e3 * x:.4f};{1e3 * y:.4f}" for x, y in points]
    return "\n".join(lines) + "\n"


def loop_csv(spec) -> str:
    """Return the file with the force on the cam as it was built, with the decimal commas of a German machine."""
    rng = np.random.default_rng(5)
    rest = spec.get_value("mechanism.rest_half_width") + LONGER
    changes = {"mechanism.rolling_friction": FRICTION, "mechanism.rest_half_width": rest}
    curve = cfmkit.analyze(spec.replace(changes)).curve
    way = np.arange(5e-3, 130e-3, SPEED / RATE)
    lines, time = ["synthetic: made by configs/synthetic/make_cam_data.py", "Zeit [s];Weg [mm];Kraft [N]"], 0.0
    for branch, places in (("load", way), ("unload", way[::-1])):
        part = curve.select_branch(branch)
        order = np.argsort(part.motion)
        forces = np.interp(places, part.motion[order], part.effort[order]) + rng.normal(0.0, FORCE_NOISE, len(places))
        for place, force in zip(places, forces, strict=True):
            time += 1.0 / RATE
            lines.append(f"{time:.3f};{1e3 * place:.4f};{force:.3f}".replace(".", ","))
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write both files."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    design = cfmkit.load(HERE.parent / "cam.yaml")
    (folder / "cam_flanks.csv").write_text(flanks_csv(assemble(design).profile))
    built = cfmkit.load(HERE.parent / "cam_as_built.yaml")
    (folder / "cam_loop.csv").write_text(loop_csv(built))


if __name__ == "__main__":
    main()
