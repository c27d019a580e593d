"""Sizes in which sheets, wire, pins, bearings and screws are sold, by series with standard and source; fits of holes.

A size that no text could be named for is not here: a series may end where the text that was read ends. Where no series
of a material is known, nothing is rounded and nothing is refused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

System = Literal["metric", "inch"]
Kind = Literal["sheet", "wire", "pin", "dowel", "bearing", "screw"]

SIZE_RTOL = 1e-6  # a size that is so near to one of a series is that one: inches are written in millimetres
KIND_WORDS: Mapping[Kind, str] = {
    "sheet": "sheet that is {} thick",
    "wire": "wire of {}",
    "pin": "pin of {}",
    "dowel": "dowel pin of {}",
    "bearing": "bearing with a bore of {}",
    "screw": "screw of {}",
}


@dataclass(frozen=True)
class StockSeries:
    """Sizes of one kind of stock."""

    kind: Kind
    system: System
    standard: str  # that defines the sizes, or "sellers' list"
    read: str  # text in which the sizes were read
    sizes: tuple[float, ...]  # thickness of sheets, else diameter, of bearings that of the bore [m], increasing
    materials: tuple[str, ...] = ()  # of sheets: names in `show materials`

    def holds(self, size: float) -> bool:
        """Return True if a size [m] is one of the series."""
        return math.isclose(self.nearest(size), size, rel_tol=SIZE_RTOL)

    def nearest(self, size: float) -> float:
        """Return the size that is nearest to another one by their ratio [m].

        >>> series_of("pin", "metric").nearest(0.0033)
        0.003
        """
        return self.sort_by_distance(size)[0]

    def sort_by_distance(self, size: float) -> tuple[float, ...]:
        """Return all sizes, those first whose ratio to another size [m] is nearest to 1."""
        return tuple(sorted(self.sizes, key=lambda entry: abs(math.log(entry / size))))


def _mm(*sizes: float) -> tuple[float, ...]:
    return tuple(float(f"{size * 1e-3:.12g}") for size in sizes)


def _inches(*sizes: float) -> tuple[float, ...]:
    return tuple(float(f"{size * 0.0254:.12g}") for size in sizes)


@dataclass(frozen=True)
class Bearing:
    """Deep groove ball bearing."""

    name: str
    bore: float  # [m]
    outer: float  # [m]
    width: float  # [m]


BOLTS_LIBRARY = "BOLTS parts library (boltsparts/BOLTS_archive, data/bearings.blt, and its tables of release 0.3)"
FASTENER_TABLES = "data of the FreeCAD Fasteners workbench (shaise/FreeCAD_FastenersWB, FsData)"
BALL_BEARINGS = tuple(
    Bearing(name, *_mm(bore, outer, width))
    for name, bore, outer, width in (
        ("623", 3, 10, 4), ("624", 4, 13, 5), ("634", 4, 16, 5), ("625", 5, 16, 5), ("635", 5, 19, 6),
        ("626", 6, 19, 6), ("607", 7, 19, 6), ("627", 7, 22, 7), ("608", 8, 22, 7), ("609", 9, 24, 7),
        ("629", 9, 26, 8), ("6000", 10, 26, 8), ("16100", 10, 28, 8), ("6200", 10, 30, 9), ("6300", 10, 35, 11),
        ("6001", 12, 28, 8), ("16101", 12, 30, 8), ("6201", 12, 32, 10), ("6301", 12, 37, 12), ("16002", 15, 32, 8),
        ("6002", 15, 32, 9), ("6202", 15, 35, 11), ("6302", 15, 42, 13), ("16003", 17, 35, 8), ("6003", 17, 35, 10),
        ("6203", 17, 40, 12), ("6303", 17, 47, 14), ("16004", 20, 42, 8), ("6004", 20, 42, 12), ("6204", 20, 47, 14),
        ("6304", 20, 52, 15), ("16005", 25, 47, 8), ("6005", 25, 47, 12), ("6205", 25, 52, 15), ("6305", 25, 62, 17),
        ("16006", 30, 55, 9), ("6006", 30, 55, 13), ("6206", 30, 62, 16), ("16007", 35, 62, 9), ("6007", 35, 62, 14),
    )
)  # fmt: skip
"""DIN 625-1: designation, bore, outside diameter, width."""


@dataclass(frozen=True)
class Screw:
    """Hexagon socket head cap screw with the hole that it passes through."""

    name: str
    diameter: float  # [m]
    head: float  # diameter of the head, ISO 4762 [m]
    hole: float  # clearance hole, ISO 273 medium [m]

    @property
    def head_height(self) -> float:
        """Height of the head [m]: that of ISO 4762 is the diameter of the thread."""
        return self.diameter

    @property
    def countersunk_height(self) -> float:
        """Height of the head of a countersunk screw of the same thread, ISO 10642 [m]; of M16 a little more."""
        return 0.62 * self.diameter

    def length(self, least: float) -> float:
        """Return the shortest length of ISO 4762 that is at least so long [m], or that length beyond the longest."""
        return next((size for size in SCREW_LENGTHS if least <= size * (1 + SIZE_RTOL)), least)


SOCKET_SCREWS = tuple(
    Screw(f"M{diameter:g}", *_mm(diameter, head, hole))
    for diameter, head, hole in (
        (1.6, 3.0, 1.8), (2, 3.8, 2.4), (2.5, 4.5, 2.9), (3, 5.5, 3.4), (4, 7, 4.5), (5, 8.5, 5.5), (6, 10, 6.6),
        (8, 13, 9), (10, 16, 11), (12, 18, 13.5), (16, 24, 17.5),
    )
)  # fmt: skip
"""ISO 4762 heads and ISO 273 medium holes."""
SCREW_LENGTHS = _mm(2.5, 3, 4, 5, 6, 8, 10, 12, 14, 16, *range(20, 81, 5), *range(100, 161, 10))
"""ISO 4762 [data of the FreeCAD Fasteners workbench, iso4762def.csv]."""
MARKET_SOURCE = "sellers' list"
ALL_SERIES = (
    StockSeries("sheet", "metric", MARKET_SOURCE,
           "aluminiumplatesupplier.com, how to choose aluminum plate thickness (6061)",
           _mm(0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.2, 1.5, 1.8, 2, 2.3, 2.5, 2.8, 3, 3.5, 4, 5, 6, 7, 8, 9, 10, 12,
               14, 16, 18, 20, 22, 25, 30), ("aluminium-6061-t6",)),
    StockSeries("sheet", "metric", MARKET_SOURCE, "pandasmetal.github.io, aluminium sheet 1 mm thickness (6061, 7075)",
           _mm(0.3, 0.5, 0.8, 1, 1.2, 1.5, 2, 2.5, 3, 4, 5), ("aluminium-7075-t6",)),
    StockSeries("sheet", "metric", MARKET_SOURCE,
           "machinemfg.com, 304 and 316 stainless steel plate weight chart, up to 3 mm",
           _mm(0.5, 0.8, 1, 1.2, 1.5, 2, 2.5, 3), ("steel-304",)),
    StockSeries("sheet", "metric", MARKET_SOURCE, "usisteels.com, standard mild steel plate thickness chart",
           _mm(1.6, 2, 3, 5, 6, 8, 10, 12, 16, 20, 25), ("steel-s235",)),
    StockSeries("sheet", "inch", MARKET_SOURCE, "pandasmetal.github.io, cutting 6mm aluminium sheet (6061, inch)",
           _inches(0.025, 0.032, 0.040, 0.050, 0.063, 0.080, 0.090, 0.100, 0.125, 0.160, 0.190, 0.25, 0.3125, 0.375,
                   0.4375, 0.5, 0.625, 0.75, 0.875, 1), ("aluminium-6061-t6",)),
    StockSeries("sheet", "inch", MARKET_SOURCE, "github.com/machineagency/jubilee, wiki, Parts to Laser Cut (Delrin)",
           _inches(0.0625, 0.09375, 0.125), ("pom",)),
    StockSeries("wire", "metric", "EN 10270-1, and preferred numbers of ISO 3, R10",
           "springwire.net, spring wire sizes and tolerances; durofer.ch, spring wire; mollificiomodenese.it, carbon "
           "steel wire EN 10270-1",
           _mm(0.05, 0.06, 0.07, 0.08, 0.09, 0.1, 0.11, 0.12, 0.14, 0.16, 0.18, 0.2, 0.22, 0.25, 0.28, 0.3, 0.32, 0.34,
               0.36, 0.38, 0.4, 0.45, 0.5, 0.6, 0.63, 0.7, 0.8, 0.9, 1, 1.1, 1.2, 1.25, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8,
               1.9, 2, 2.1, 2.4, 2.5, 2.6, 2.8, 3, 3.15, 3.2, 3.4, 3.5, 3.6, 3.8, 4, 4.5, 5, 5.5, 6, 6.3, 6.5, 7, 7.5,
               8, 8.5, 9, 9.5, 10)),
    StockSeries("wire", "inch", "ASTM A228", "interwiregroup.com, tinned coated music wire",
           _inches(0.004, 0.005, 0.006, 0.007, 0.008, 0.009, 0.010, 0.011, 0.012, 0.013, 0.014, 0.015, 0.016, 0.018,
                   0.020, 0.022, 0.024, 0.026, 0.028, 0.030, 0.032, 0.034, 0.036, 0.038, 0.040, 0.042, 0.045, 0.048,
                   0.051, 0.055, 0.059, 0.063, 0.067, 0.072, 0.076, 0.080, 0.085, 0.090, 0.095, 0.100, 0.102, 0.107,
                   0.110, 0.112, 0.121, 0.125, 0.130, 0.135, 0.140, 0.145, 0.150, 0.156, 0.162, 0.177, 0.192, 0.207,
                   0.225, 0.250)),
    StockSeries("pin", "metric", "ISO 2338", f"{FASTENER_TABLES}, iso2338def.csv",
           _mm(0.6, 0.8, 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 12, 16, 20, 25, 30, 40, 50)),
    StockSeries("pin", "inch", "ASME B18.8.2", "hdw.com.tw, ANSI dowel pins chart",
           _inches(0.0625, 0.078125, 0.09375, 0.125, 0.15625, 0.1875, 0.25, 0.3125, 0.375, 0.4375, 0.5, 0.625, 0.75,
                   0.875, 1)),
    StockSeries("dowel", "metric", "ISO 8734", f"{FASTENER_TABLES}, iso8734def.csv",
           _mm(1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 12, 16, 20)),
    StockSeries("bearing", "metric", "DIN 625-1", BOLTS_LIBRARY, tuple(sorted({b.bore for b in BALL_BEARINGS}))),
    StockSeries("screw", "metric", "ISO 4762, holes ISO 273 medium",
           f"{FASTENER_TABLES}, iso4762def.csv; engineeringhardware.com, clearance hole sizes",
           tuple(entry.diameter for entry in SOCKET_SCREWS)),
)  # fmt: skip
"""All series that a text is known for: no inch series of bearings, dowels and screws, and few of sheets."""


def series_of(kind: Kind, system: System, material: str | None = None) -> StockSeries | None:
    """Return the series of one kind of stock, of sheets that of a material by its name; None if none is known."""
    return next(
        (
            entry
            for entry in ALL_SERIES
            if entry.kind == kind and entry.system == system and (kind != "sheet" or material in entry.materials)
        ),
        None,
    )


def missing_size(kind: Kind, system: System, size: float, material: str | None = None) -> str:
    """Return why a size [m] cannot be bought, with the nearest that can; empty if it can, or if no series is known.

    >>> missing_size("sheet", "metric", 0.0063, "aluminium-6061-t6")
    "no metric sheet that is 6.3 mm thick (aluminium-6061-t6; sellers' list); the nearest is 6 mm"
    >>> missing_size("pin", "metric", 0.003)
    ''
    """
    series = series_of(kind, system, material)
    if series is None or series.holds(size):
        return ""
    about = f"{material}; {series.standard}" if kind == "sheet" else series.standard
    stated, nearest = (format_short(entry, "length", 6) for entry in (size, series.nearest(size)))
    return f"no {system} {KIND_WORDS[kind].format(stated)} ({about}); the nearest is {nearest}"


FIT_LIMITS = _mm(3, 6, 10, 18, 30, 50, 80)
FIT_TOLERANCES = {7: (10, 12, 15, 18, 21, 25, 30), 8: (14, 18, 22, 27, 33, 39, 46)}
"""ISO 286-2: largest diameter of each range, and upper deviation of holes H7 and H8 there, in thousandths of a mm [read
in the tables of public fit calculators that name ISO 286-2:2010]."""


def hole_with_fit(diameter: float, grade: Literal[7, 8]) -> str:
    """Return a hole of a diameter [m] with its fit: H8 turns on a pin h8, H7 seats a bearing or a dowel.

    >>> hole_with_fit(0.003, 8), hole_with_fit(0.022, 7), hole_with_fit(0.1, 7)
    ('3 mm H8 (+0.014)', '22 mm H7 (+0.021)', '100 mm')
    """
    text = format_short(diameter, "length")
    place = next((k for k, largest in enumerate(FIT_LIMITS) if diameter <= largest * (1 + SIZE_RTOL)), None)
    return text if place is None else f"{text} H{grade} (+{1e-3 * FIT_TOLERANCES[grade][place]:.3f})"


PIN_LENGTHS = _mm(2, 3, 4, 5, 6, 8, *range(10, 33, 2), *range(35, 101, 5), *range(120, 201, 20))
PIN_RANGES = tuple(zip(
    next(entry for entry in ALL_SERIES if entry.standard == "ISO 2338").sizes,
    _mm(2, 2, 4, 4, 4, 6, 6, 8, 8, 10, 12, 14, 18, 22, 26, 35, 50, 60, 80, 95),
    _mm(6, 8, 10, 12, 16, 20, 24, 30, 40, 50, 60, 80, 95, 140, 180, 200, 200, 200, 200, 200), strict=True,
))  # fmt: skip
"""ISO 2338: lengths of pins, and diameters with their smallest and largest [m] [data of the FreeCAD Fasteners
workbench, iso2338length.csv and iso2338range.csv]."""


def pin_length(diameter: float, least: float) -> float | None:
    """Return the shortest pin of ISO 2338 that is at least so long [m]; None if none of the diameter is.

    >>> pin_length(0.003, 0.0131), pin_length(0.001, 0.0131), pin_length(0.003, 0.006)
    (0.014, None, 0.008)
    """
    ranges = (ends for size, *ends in PIN_RANGES if math.isclose(size, diameter, rel_tol=SIZE_RTOL))
    shortest, longest = next(ranges, (0.0, 0.0))
    least = max(least, shortest)
    return next((size for size in PIN_LENGTHS if least <= size * (1 + SIZE_RTOL) and size <= longest), None)


Path = tuple[str | int, ...]
StockSize = tuple[Path, Kind, float | None]


def stock_faults(system: System | None, sizes: Iterable[StockSize], material: str | None = None) -> dict[Path, str]:
    """Return what of a mechanism is not sold, by its key below `mechanism`; nothing without a system of stock.

    >>> stock_faults("metric", [(("pins", "diameter"), "pin", 0.0033)])
    {('mechanism', 'pins', 'diameter'): 'no metric pin of 3.3 mm (ISO 2338); the nearest is 3 mm'}
    """
    if system is None:
        return {}
    result = {
        ("mechanism", *path): missing_size(kind, system, float(size), material)
        for path, kind, size in sizes
        if size is not None
    }
    return {path: text for path, text in result.items() if text}


def bearings_of(bore: float) -> tuple[Bearing, ...]:
    """Return the bearings with a bore [m], the smallest first.

    >>> [one.name for one in bearings_of(0.008)]
    ['608']
    """
    fitting = (entry for entry in BALL_BEARINGS if math.isclose(entry.bore, bore, rel_tol=SIZE_RTOL))
    return tuple(sorted(fitting, key=lambda entry: (entry.outer, entry.width)))


def screw_through(hole: float) -> Screw | None:
    """Return the largest screw that passes through a hole of a diameter [m]; None if even the smallest is too thick.

    >>> screw_through(0.0066).name, screw_through(0.004).name
    ('M6', 'M3')
    """
    return next((entry for entry in reversed(SOCKET_SCREWS) if entry.hole <= hole * (1 + SIZE_RTOL)), None)
