"""LastingData data on how materials last and creep, for where a specification states nothing better.

S-N data of steels follow the rule of a text book from their least tensile strength; creep is that of a data sheet. Each
says its source and how far it may be off. Materials that are missing here have no such data: printed plastics,
whose layers decide, and metals for which no table was read.

Texts that several sources name by a short word
-----------------------------------------------
Shigley
    Budynas and Nisbett, Shigley's Mechanical Engineering Design, 9th edition: sec. 6-7 (S_e' = 0.5 S_ut, from 0.4 to
    0.6 of it), sec. 6-8 (f S_ut at 1000 cycles), Table 6-2 (surface: k_a = a S_ut^b).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

_ONE_HOUR = 3600.0
_ONE_KPSI = 6.894757e6
_FIRST_CYCLES, _KNEE_CYCLES, _LAST_CYCLES = 1e3, 1e6, 1e9


@dataclass(frozen=True)
class AssumedFatigue:
    """Amplitudes that are borne, fully reversed, and the tensile strength."""

    points: tuple[tuple[float, float], ...]  # cycles [1] and amplitude [Pa]
    ultimate_strength: float  # [Pa]
    spread: tuple[float, float]  # from where to where the last amplitude is found [Pa]
    source: str


@dataclass(frozen=True)
class AssumedCreep:
    """Moduli while a load is held, taken as those while a strain is held."""

    points: tuple[tuple[float, float], ...]  # time [s] and modulus [Pa]
    temperature: str
    source: str


@dataclass(frozen=True)
class LastingData:
    """LastingData data of one material; None: nothing is assumed."""

    fatigue: AssumedFatigue | None = None
    relaxation: AssumedCreep | None = None
    loss_factor: float | None = None  # order of size [1]; no model uses it
    loss_source: str = ""


def strength_fraction(ultimate: float) -> float:
    """Return the share f of its tensile strength [Pa] that a steel bears 1000 times (Shigley, sec. 6-8).

    Examples
    --------
    >>> round(strength_fraction(100 * 6.894757e6), 3)
    0.849
    >>> strength_fraction(360e6)
    0.9
    """
    kpsi = ultimate / _ONE_KPSI
    return 0.9 if kpsi < 70.0 else 1.06 - 2.8e-3 * kpsi + 6.9e-6 * kpsi**2


def machined_surface(ultimate: float) -> float:
    """Return what a machined surface leaves of the endurance limit (Shigley, Table 6-2).

    Examples
    --------
    >>> round(machined_surface(520e6), 2)
    0.86
    """
    return min(1.0, 4.51 * math.pow(ultimate / 1e6, -0.265))


def steel(ultimate: float, strength: str) -> AssumedFatigue:
    """Return the S-N points of a steel with machined edges, from its least tensile strength [Pa] and where it stands.

    Examples
    --------
    >>> [round(amplitude / 1e6) for _, amplitude in steel(515e6, "ASTM A240").points]
    [458, 222, 222]
    """
    surface = machined_surface(ultimate)
    limit = round(0.5 * surface * ultimate, -6)
    points = (
        (_FIRST_CYCLES, round(strength_fraction(ultimate) * ultimate, -6)),
        (_KNEE_CYCLES, limit),
        (_LAST_CYCLES, limit),
    )
    low, high = (round(share * surface * ultimate, -6) for share in (0.4, 0.6))
    return AssumedFatigue(
        points,
        ultimate,
        (low, high),
        f"assumed: from the tensile strength {ultimate / 1e6:.0f} MPa ({strength}) by Shigley, sec. 6-7, 6-8 and Table "
        f"6-2, machined edges; endurance limit from {low / 1e6:.0f} to {high / 1e6:.0f} MPa",
    )


def _creep(moduli: tuple[float, float, float], source: str) -> AssumedCreep:
    """Return moduli [Pa] at once, after 1 h and after 1000 h."""
    times = (0.0, _ONE_HOUR, 1000.0 * _ONE_HOUR)
    return AssumedCreep(
        tuple(zip(times, moduli, strict=True)),
        "23 deg C",
        f"assumed: tensile creep modulus (ISO 899-1) of {source}",
    )


_LOSS_LECTURE = "NPTEL course 112104040, lecture 9, Table 9.1, order of size"
ASSUMED_DATA: Mapping[str, LastingData] = MappingProxyType(
    {
        "steel-1.4310": LastingData(steel(1300e6, "EN 10151, +C1300"), loss_factor=1e-3, loss_source=_LOSS_LECTURE),
        "steel-304": LastingData(steel(515e6, "ASTM A240"), loss_factor=1e-3, loss_source=_LOSS_LECTURE),
        "steel-s235": LastingData(steel(360e6, "EN 10025-2"), loss_factor=1e-3, loss_source=_LOSS_LECTURE),
        "aluminium-6061-t6": LastingData(loss_factor=1e-5, loss_source=_LOSS_LECTURE),
        "aluminium-7075-t6": LastingData(loss_factor=1e-5, loss_source=_LOSS_LECTURE),
        "pom": LastingData(
            relaxation=_creep(
                (2850e6, 2500e6, 1300e6),
                "Hostaform C 9021, data sheet; C 27021 keeps 45 % after 1000 h, this one 46 %; other grades and "
                "temperatures differ more",
            )
        ),
        "pa66": LastingData(
            relaxation=_creep(
                (1400e6, 1190e6, 540e6),
                "Zytel 103HSL NC010, conditioned, data sheet; spread not stated: humidity changes it much",
            )
        ),
        "pc": LastingData(
            relaxation=_creep((2400e6, 2200e6, 1900e6), "Makrolon 2405, data sheet; spread not stated"),
        ),
    }
)
"""By the name of the material."""
