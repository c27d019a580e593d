"""Material in use: cycles to failure, and the modulus that is left after a hold.

Fatigue: the window is one cycle, from the least stress in it to the largest and back, both taken at one place and with
one sign. Goodman's line turns amplitude s_a and mean s_m into the fully reversed amplitude s_a / (1 - s_m / s_u)
[SH, ch. 6], which the S-N points (straight between them in log s over log N) or Basquin's line s = s_f' (2 N)^b
turn into a number of cycles. Relaxation: at a held displacement all stresses follow the modulus, F(t)/F(0) =
E(t)/E(0), whatever the geometry, as long as the material is linear and has one modulus.

Assumes: one material; one stress range for all cycles; temperature and rate of the data.

Reference
---------
[SH] R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 10th ed., McGraw-Hill (2015).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cfmkit.metrics.branches import Undefined

FIRST_TIME = 1e-9
"""In place of a first point at 0, which log t does not have [s]: so early that most of the fall to the next point is
over long before that one, where the force is hardly more than at it, which is conservative."""


@dataclass(frozen=True)
class FatigueLaw:
    """Fully reversed stress amplitude over the number of cycles, and the mean stress that it bears."""

    # cycles and amplitude [Pa], cycles increasing; empty where `basquin` is given
    points: tuple[tuple[float, float], ...]
    basquin: tuple[float, float] | None  # coefficient s_f' [Pa] and exponent b
    ultimate: float  # ultimate strength s_u [Pa]

    def life(self, largest: float, least: float = 0.0) -> float:
        """Return the number of cycles between two stresses [Pa] until failure.

        Below the lowest S-N point it is the cycles of that point: more have not been shown.

        Raises Undefined if there is no amplitude, the mean is above the ultimate strength, or the amplitude above every
        S-N point.
        """
        amplitude, mean = 0.5 * (largest - least), 0.5 * (largest + least)
        if amplitude <= 0:
            raise Undefined("the stress does not change over the window: nothing is fatigued")
        if mean >= self.ultimate:
            raise Undefined("the mean stress is above the ultimate strength")
        return self._cycles(amplitude / (1.0 - mean / self.ultimate))

    def _cycles(self, reversed_amplitude: float) -> float:
        if self.basquin is not None:
            coefficient, exponent = self.basquin
            return max(0.5 * math.pow(reversed_amplitude / coefficient, 1.0 / exponent), 0.5)
        cycles, amplitudes = np.log(np.array(self.points)).T
        wanted = math.log(reversed_amplitude)
        if wanted > amplitudes[0] * (1 + 1e-12):
            raise Undefined(
                f"the amplitude is above that of the first S-N point: fewer than {self.points[0][0]:g} cycles"
            )
        return float(np.exp(np.interp(-wanted, -amplitudes, cycles)))

    def strength(self, cycles: float) -> float:
        """Return the largest stress [Pa] of a cycle from 0 that lasts so many cycles: s = 2 a / (1 + a / s_u)."""
        if self.basquin is not None:
            coefficient, exponent = self.basquin
            amplitude = coefficient * math.pow(2.0 * cycles, exponent)
        else:
            counts, amplitudes = np.log(np.array(self.points)).T
            amplitude = float(np.exp(np.interp(math.log(cycles), counts, amplitudes)))
        return 2.0 * amplitude / (1.0 + amplitude / self.ultimate)


@dataclass(frozen=True)
class RelaxationLaw:
    """Fall of the modulus at a constant strain."""

    # share and relaxation time [s] of each Prony term; empty where `points` are given
    terms: tuple[tuple[float, float], ...] = ()
    points: tuple[tuple[float, float], ...] = ()  # time [s] and modulus [Pa], times increasing

    def ratio(self, time: float) -> float:
        """Return E(t)/E(0) after a time [s]: by the Prony series, or along log t between the points.

        Raises Undefined if the time is beyond the last point.
        """
        if self.terms:
            return 1.0 - sum(share * -math.expm1(-time / tau) for share, tau in self.terms)
        times, moduli = np.array(self.points).T
        if time > times[-1] * (1 + 1e-12):
            raise Undefined(f"the points of the relaxation end at {hold_text(float(times[-1]))}")
        if time <= times[0]:
            return 1.0
        return float(np.interp(math.log(time), np.log(np.maximum(times, FIRST_TIME)), moduli) / moduli[0])


@dataclass(frozen=True)
class Durability:
    """Durability of a material: its fatigue, its relaxation, and the holds [s] that are reported."""

    fatigue: FatigueLaw | None = None
    relaxation: RelaxationLaw | None = None
    holds: tuple[float, ...] = ()
    assumed: tuple[str, ...] = ()  # where the data come from that no specification states


def hold_text(time: float) -> str:
    """Return a time as the name of a metric has it.

    Examples
    --------
    >>> hold_text(3.6e6), hold_text(90.0)
    ('1000 h', '90 s')
    """
    return f"{time / 3600:g} h" if time >= 3600 else f"{time:g} s"
