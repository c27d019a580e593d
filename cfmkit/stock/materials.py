"""Named materials with source and scatter, and the fatigue, creep and loss data that are assumed of them.

The nominal value is where a design starts; the scatter is what it must survive. For metals the low end is the minimum
of the standard. For printed plastics the range is wide on purpose: orientation, layer adhesion, printer, humidity and
the maker of the filament all affect it, and none of them is known to this library.

All values are at room temperature and for short-term loads. Plastics creep: a part that is held deflected loses force
with time, which no modulus here shows. For plastics the yield strength is the stress at yield of a tensile test.

How materials last and creep is for where a specification states nothing better. S-N data of steels follow the rule of a
text book from their least tensile strength; creep is that of a data sheet. Each says its source and how far it may be
off. Materials that are missing there have no such data: printed plastics, whose layers decide, and metals for which no
table was read.

Texts that several sources name by a short word
-----------------------------------------------
engineeringtoolbox
    engineeringtoolbox.com/poissons-ratio-d_1224.html: Poisson ratios of metals.
Multimedia Engineering Mechanics
    ecoursesbook.com, appendix Material Properties: Poisson ratios.
Triton College
    academics.triton.edu/faculty/fheitzman/strengthofmaterials.html: Poisson ratios.
Dowling
    N. E. Dowling, Mechanical Behavior of Materials, Table 5.2.
e-uparts
    e-uparts.com, kikaibinran, siryou2-4: densities and strengths of plastics.
"""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping


Range = tuple[float, float]


class UnknownMaterial(InputError, ValueError):
    """A material name that the library does not have (also a ValueError, for validators)."""


@dataclass(frozen=True)
class Scatter:
    """From where to where a property is found in practice, low to high."""

    youngs_modulus: Range  # [Pa]
    yield_strength: Range | None = None  # [Pa]; None if there is no strength
    # poisson_ratio, density: [1] and [kg/m^3], from the lowest to the highest of the texts that the source names; None
    # where these state one value, or none
    poisson_ratio: Range | None = None
    density: Range | None = None


@dataclass(frozen=True)
class Material:
    """One material."""

    name: str  # how a specification calls it
    youngs_modulus: float  # nominal elastic modulus [Pa]
    poisson_ratio: float  # nominal Poisson ratio
    yield_strength: float | None  # nominal yield strength [Pa]; None if the source gives none
    density: float  # [kg/m^3]
    source: str  # where the numbers come from
    scatter: Scatter  # range of modulus and strength to expect
    aliases: tuple[str, ...] = ()  # other words for it; a name that is not found is compared with these too
    poisson_is_assumed: bool = False  # whether no text is known for the Poisson ratio


_METAL_LIST = (
    Material(
        "steel-1.4310", 179e9, 0.29, 965e6, 7900.0,
        "E: EN 10151 strip 1.4310, cold rolled to Rm 1300 MPa, along the grain (189 GPa after tempering, 195 GPa at "
        "Rm 1800 MPa). Density: EN 10088-1. Yield: ASTM A666 type 301 full hard, minimum; upper end typical of strip "
        "+C1300. Spread of the Poisson ratio: Triton College (stainless, 0.27) and engineeringtoolbox (18-8, 0.305); "
        "of the density: Important Properties of selected Engineering Materials (scribd.com 372037000; type 302, "
        "7860 kg/m^3).",
        Scatter((175e9, 195e9), (930e6, 1300e6), poisson_ratio=(0.27, 0.305), density=(7860.0, 7900.0)),
        ("spring-steel", "aisi-301", "stainless-spring-steel", "301"),
    ),
    Material(
        "steel-304", 200e9, 0.29, 205e6, 7900.0,
        "E and density: EN 10088-1, steel 1.4301 (AISI 304). Yield: ASTM A240, annealed, minimum; upper end typical "
        "of cold-rolled sheet. Poisson ratio: between the 0.27 and 0.30 of tables for AISI 304 and 302. Their "
        "spread: Triton College (stainless, 0.27) and engineeringtoolbox (18-8, 0.305); of the density: Material "
        "Density Chart (scribd.com 238232402; 8000 kg/m^3).",
        Scatter((190e9, 200e9), (205e6, 310e6), poisson_ratio=(0.27, 0.305), density=(7900.0, 8000.0)),
        ("aisi-304", "1.4301", "stainless-steel"),
    ),
    Material(
        "steel-s235", 210e9, 0.30, 235e6, 7850.0,
        "EN 1993-1-1, sec. 3.2.6, and EN 10025-2, S235 up to 16 mm, minimum; upper end typical of mill certificates. "
        "Density: EN 1991-1-1, Table A.4 (78.5 kN/m^3). Spread of the Poisson ratio of A36: Multimedia Engineering "
        "Mechanics (0.29), Triton College (0.32); of the density: Important Properties of selected Engineering "
        "Materials (scribd.com 372037000; alloy 1020, 7870 kg/m^3).",
        Scatter((200e9, 212e9), (235e6, 340e6), poisson_ratio=(0.29, 0.32), density=(7850.0, 7870.0)),
        ("structural-steel", "mild-steel", "steel"),
    ),
    Material(
        "aluminium-6061-t6", 68.9e9, 0.33, 276e6, 2700.0,
        "Aluminum Association typical values, as in the ASM data sheet; low end of the yield: ASTM B209 minimum. "
        "Spread of the Poisson ratio: Multimedia Engineering Mechanics (0.33), engineeringtoolbox (0.35).",
        Scatter((68e9, 70e9), (240e6, 290e6), poisson_ratio=(0.33, 0.35)), ("6061-t6", "aluminum-6061-t6", "al-6061"),
    ),
    Material(
        "aluminium-7075-t6", 71.7e9, 0.33, 503e6, 2810.0,
        "Aluminum Association typical values, as in the ASM data sheet; low end of the yield: typical of thick "
        "plate. Poisson ratio: 0.33 in Multimedia Engineering Mechanics and at Triton College.",
        Scatter((70e9, 72.5e9), (440e6, 540e6)), ("7075-t6", "aluminum-7075-t6", "al-7075"),
    ),
    Material(
        "titanium-6al-4v", 113.8e9, 0.342, 880e6, 4430.0,
        "ASM data sheet, Ti-6Al-4V (grade 5), annealed; low end of the yield: ASTM B265 minimum; modulus 105 to 120 "
        "GPa with texture and heat treatment. Low end of the Poisson ratio: Multimedia Engineering Mechanics.",
        Scatter((105e9, 120e9), (828e6, 980e6), poisson_ratio=(0.33, 0.342)), ("ti-6al-4v", "ti64", "titanium"),
    ),
    Material(
        "beryllium-copper", 131e9, 0.30, 1000e6, 8360.0,
        "C17200 (CuBe2), precipitation hardened, tempers TF00 to TH04. E: material-properties.org, beryllium copper "
        "(131 GPa, yield 1110 MPa); Alloy Wire CB 101 (123 GPa). Density: Little Falls Alloys, alloy 25 (8350 "
        "kg/m^3) and Fisk Alloy, C17200 (0.298 lb/in^3). Poisson ratio: between engineeringtoolbox (0.285) and "
        "Multimedia Engineering Mechanics (CDA 172, 0.33). Ends of the yield: no source named; take those of your "
        "strip.",
        Scatter((120e9, 134e9), (890e6, 1380e6), poisson_ratio=(0.285, 0.33), density=(8250.0, 8360.0)),
        ("c17200", "cube2", "beryllium-bronze"),
    ),
)  # fmt: skip
_PLASTIC_LIST = (
    Material(
        "pla", 3.0e9, 0.36, 45e6, 1240.0,
        "Printed (filament). Nominal: Stratasys PLA, ASTM D638, on edge (3.04 GPa, yield 45 MPa; flat 2.54 GPa, 26 "
        "MPa). Low end: PolyTerra PLA data sheet V5.3, ISO 527, between the layers (1.6 GPa, 12 MPa). High end and "
        "density: additive.tools/materials/pla (to 4 GPa and 65 MPa, 1220 to 1260 kg/m^3). Poisson ratio: "
        "FreeCAD's card of PLA (0.36, from SD3D's data sheet).",
        Scatter((1.6e9, 4.0e9), (12e6, 65e6), density=(1220.0, 1260.0)), ("polylactide", "pla-plus"),
    ),
    Material(
        "abs", 2.0e9, 0.35, 33e6, 1040.0,
        "Printed (filament): from 1.44 GPa (Kimya, ISO 527; PMC10406103, Table 2) to 2.41 GPa (Stratasys Fortus "
        "ABS-M30, ASTM D638). Nominal: middle of that range; strength: ABS-M30 as Loughborough University tested it "
        "(ISO 527, 33 MPa; published 36 MPa); low end: between the layers. Poisson ratio: Dowling (medium impact, "
        "0.35). Density: e-uparts (1030 to 1060 kg/m^3).",
        Scatter((1.4e9, 2.5e9), (20e6, 43e6), density=(1030.0, 1060.0)), ("acrylonitrile-butadiene-styrene",),
    ),
    Material(
        "petg", 2.0e9, 0.38, 45e6, 1270.0,
        "Printed (filament): additive.tools/materials/petg (2 to 3 GPa and 44 to 56 MPa in the plane, 25 to 38 MPa "
        "between the layers, 1250 to 1290 kg/m^3). The modulus is the low end of that: printed PETG is often softer. "
        "Poisson ratio: assumed.",
        Scatter((1.5e9, 2.9e9), (25e6, 56e6), density=(1250.0, 1290.0)), ("pet-g",), poisson_is_assumed=True,
    ),
    Material(
        "pa12-sls", 1.65e9, 0.41, 48e6, 930.0,
        "Laser sintered, EOS PA 2200 class. Strength and density: additive.tools/materials/pa12 (44 to 52 MPa, 880 "
        "to 960 kg/m^3). Modulus: between 3D Systems' PA12 (1.39 GPa, 43 MPa; PMC10406103, Table 2) and 1.9 GPa; it "
        "varies with powder refresh, orientation and humidity. Poisson ratio: 0.408 by ultrasound, Duraform PA (Rapid "
        "Prototyping Journal 14 (5), 260).",
        Scatter((1.35e9, 1.9e9), (40e6, 52e6), density=(880.0, 960.0)), ("pa12", "nylon-12", "nylon-sls", "pa-2200"),
    ),
    Material(
        "pa12-mjf", 1.8e9, 0.43, 48e6, 1010.0,
        "Multi Jet Fusion: HP 3D High Reusability PA 12 data sheet, balanced mode, ASTM D638, Z direction (Poisson "
        "ratio 0.47 in XY); scatter: other print modes and the literature. Low end of the density: "
        "additive.tools/materials/pa12.",
        Scatter((1.25e9, 1.9e9), (40e6, 54e6), poisson_ratio=(0.43, 0.47), density=(970.0, 1010.0)),
        ("pa12", "nylon-12", "nylon-mjf"),
    ),
    Material(
        "pom", 2.8e9, 0.37, 65e6, 1410.0,
        "Polyoxymethylene, moulded or machined, ISO 527: copolymer as in the data sheets of Hostaform C 9021 (2.85 "
        "GPa, 64 MPa) and C 27021 (2.9 GPa, 65 MPa), 1410 kg/m^3; homopolymer 3.0 to 3.2 GPa, 72 MPa (Delrin). Not "
        "the toughened grades. Poisson ratio: FreeCAD's cards of homopolymer (0.37) and copolymer (0.363).",
        Scatter((2.5e9, 3.2e9), (60e6, 76e6), poisson_ratio=(0.363, 0.37)),
        ("delrin", "acetal", "polyoxymethylene", "hostaform"),
    ),
    Material(
        "pa66", 1.4e9, 0.41, 55e6, 1140.0,
        "Nylon 66, moulded, conditioned at 50 % humidity: Zytel 103HSL data sheet, ISO 527 (dry: 3.1 GPa, 85 MPa); "
        "the scatter runs from wet to dry. Poisson ratio: Dowling (dry, 0.41), Multimedia Engineering Mechanics "
        "(0.40).",
        Scatter((1.2e9, 3.1e9), (45e6, 85e6), poisson_ratio=(0.40, 0.41)), ("nylon", "nylon-66", "polyamide"),
    ),
    Material(
        "pp", 1.4e9, 0.44, 32e6, 910.0,
        "Polypropylene homopolymer, ASTM D638: Modern Plastics Encyclopedia 99 (1.14 to 1.55 GPa, yield 31 to 37 "
        "MPa); nominal modulus and density: MakeItFrom, unfilled PP homopolymer (1.4 GPa, 910 kg/m^3). Low end of "
        "the density: e-uparts. Poisson ratio: FreeCAD's card of PP (0.44, from MatWeb).",
        Scatter((1.1e9, 1.6e9), (30e6, 37e6), density=(900.0, 910.0)), ("polypropylene",),
    ),
    Material(
        "pe-hd", 1.0e9, 0.42, 25e6, 955.0,
        "High-density polyethylene: greensutra.in/greenpedia/plastics (strength 22 to 31 MPa, 952 to 965 kg/m^3); "
        "low end: engineeringtoolbox.com, polymers (0.7 GPa, 20 to 30 MPa). The modulus goes with the density. "
        "Poisson ratio: Dowling (0.42); low end: Triton College (0.40). Low end of the density: e-uparts.",
        Scatter((0.7e9, 1.3e9), (20e6, 31e6), poisson_ratio=(0.40, 0.42), density=(941.0, 965.0)),
        ("hdpe", "polyethylene"),
    ),
    Material(
        "pc", 2.4e9, 0.37, 65e6, 1200.0,
        "Polycarbonate, moulded: Makrolon 2405 data sheet, ISO 527. Low ends of modulus and strength: e-uparts (210 "
        "and 5.6 kgf/mm^2); strength up to 10 ksi: medesign.seas.upenn.edu, polycarbonate; high end of the modulus: no "
        "source named. Poisson ratio: between Multimedia Engineering Mechanics (0.35) and Dowling (0.38). Spread of "
        "the density: additive.tools/materials/pc (printed, 1180 to 1220 kg/m^3).",
        Scatter((2.1e9, 2.5e9), (55e6, 70e6), poisson_ratio=(0.35, 0.38), density=(1180.0, 1220.0)),
        ("polycarbonate", "makrolon", "lexan"),
    ),
    Material(
        "tpu-95a", 26e6, 0.48, 8.6e6, 1220.0,
        "Printed (filament), Shore 95A: modulus and stress at yield: data sheet of Ultimaker TPU 95A (not read again "
        "for this table); its ends and the Poisson ratio: assumed; density: additive.tools/materials/tpu (1200 to 1250 "
        "kg/m^3); scatter of E: measured on four printed TPUs (Haid et al. 2022, 24 to 247 MPa). Strongly nonlinear: "
        "only for small strains.",
        Scatter((24e6, 250e6), (5e6, 12e6), density=(1200.0, 1250.0)), ("tpu", "polyurethane"),
        poisson_is_assumed=True,
    ),
)  # fmt: skip
_PUBLISHED_LIST = (
    Material(
        "pom-lan-2010", 2.0e9, 0.35, 76e6, 1410.0,
        "Lan, Wang, Chen 2010, Table 2: E and yield stress of their polyoxymethylene (used there with a safety "
        "factor of 1.58). Poisson ratio: assumed; density: typical POM; scatter: up to the data sheet values.",
        Scatter((2.0e9, 3.2e9), (60e6, 76e6)), poisson_is_assumed=True,
    ),
    Material(
        "pla-ding-2022", 1.477e9, 0.30, None, 1250.0,
        "Ding, Li, Li 2022, sec. 6: E and Poisson ratio of printed PLA-ST; no strength is given there. Scatter of E: "
        "printed PLA, low side. "
        "Spread of the density: additive.tools/materials/pla.",
        Scatter((1.2e9, 2.0e9), density=(1220.0, 1260.0)),
    ),
    Material(
        "abs-bilancia-2019", 1.8e9, 0.35, 42.5e6, 1040.0,
        "Bilancia, Geraci, Berselli 2019, sec. 2.2: E, Poisson ratio, and the flexural yield strength (42.5 MPa) of "
        "their ABS; density: typical ABS; scatter: printed ABS. Spread of the density: e-uparts.",
        Scatter((1.4e9, 2.5e9), (20e6, 43e6), density=(1030.0, 1060.0)),
    ),
    Material(
        "steel-85-li-hao-2019", 200e9, 0.30, 980e6, 7850.0,
        "Li, Hao 2019, sec. 7: spring steel 85, E. Yield: GB/T 1222, steel 85 quenched and tempered, minimum; "
        "Poisson ratio, density and scatter: typical carbon spring steel. Spread of the Poisson ratio: "
        "engineeringtoolbox (high carbon, 0.295), Triton College (0.8 % carbon, 0.32); of the density: Important "
        "Properties of selected Engineering Materials (scribd.com 372037000; alloy 1090).",
        Scatter((195e9, 210e9), (980e6, 1200e6), poisson_ratio=(0.295, 0.32), density=(7850.0, 7870.0)),
    ),
)  # fmt: skip
MATERIALS_BY_NAME: Mapping[str, Material] = MappingProxyType(
    {item.name: item for item in (*_METAL_LIST, *_PLASTIC_LIST, *_PUBLISHED_LIST)}
)
"""Every material by name."""


def material(name: str) -> Material:
    """Return the material of that name.

    Raises
    ------
    UnknownMaterial
        If there is none; the message names the nearest ones.

    Examples
    --------
    >>> material("pom").youngs_modulus
    2800000000.0
    """
    if name in MATERIALS_BY_NAME:
        return MATERIALS_BY_NAME[name]
    close = _nearest(name)
    hint = f"did you mean {' or '.join(map(repr, close))}?" if close else "`cfmkit show materials` lists them"
    raise UnknownMaterial(f"there is no material {name!r}; {hint}")


def _nearest(name: str) -> tuple[str, ...]:
    """Return the names that `name` could have meant, by alias or by spelling."""
    wanted = name.strip().lower().replace("_", "-").replace(" ", "-")
    words: dict[str, list[str]] = {}
    for item in MATERIALS_BY_NAME.values():
        for word in (item.name, *item.aliases):
            words.setdefault(word, []).append(item.name)
    close = [wanted] if wanted in words else difflib.get_close_matches(wanted, words, n=2, cutoff=0.6)
    return tuple(dict.fromkeys(name for word in close for name in words[word]))


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
    """Fatigue, relaxation and loss factor of one material; None: nothing is assumed."""

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
