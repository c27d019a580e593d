"""STEP: bodies whose sides are planes and cylinders, by build123d (the extra ``step``).

Lines and arcs of the outlines stay what they are: a CAD program can measure the radius of a fillet.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import CfmError, GeometryError, OutputError, UsageError
from cfmkit.numerics.arc_chain import points_on
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

    from cfmkit.export.arc_outlines import Outline
    from cfmkit.export.contours import Region, Sheet

LINE_RISE = 1e-6  # arcs that rise less over their chord are lines: less than a CAD kernel can tell [mm]


def step_bytes(name: str, drawn: Sequence[Outline], sheet: Sheet) -> bytes:
    """Return what a drawing cuts as one STEP file (AP214), in millimetres.

    Raises UsageError if build123d is not installed; GeometryError if nothing says how thick the parts are, or the
    kernel cannot make a body of them.
    """
    kernel = _kernel()
    if sheet.thickness is None:
        where = f"give {sheet.key!r}, such as 5 mm" if sheet.key else "its family has no such key"
        raise GeometryError(f"nothing says how thick the part is: {where}")
    try:
        return _step(kernel, name, [one for one in drawn if one.layer == "cut" and one.closed], sheet)
    except CfmError:
        raise
    except Exception as error:  # the kernel has dozens of its own
        reported = " ".join(f"{type(error).__name__}: {error}".split())
        raise GeometryError(f"the CAD kernel cannot make a body from the outline ({reported})") from error


def _step(kernel: Any, name: str, cut: Sequence[Outline], sheet: Sheet) -> bytes:
    wires = [(one, kernel.Wire(_edges(kernel, one))) for one in cut]
    faces = [kernel.Face(wire) for one, wire in wires if not one.hole]
    holes = [kernel.Face(wire) for one, wire in wires if one.hole]
    solids = [_solid(kernel, face, holes, sheet) for face in faces]
    if not solids or not all(solid.is_valid for solid in solids):
        raise GeometryError("the CAD kernel cannot make a valid body from the outline")
    whole = solids[0] if len(solids) == 1 else kernel.Compound(children=solids)
    whole.label = name
    return _write_step(kernel, whole)


def _kernel() -> ModuleType:
    try:
        import build123d
    except ImportError:
        raise UsageError("--format step needs build123d: pip install build123d") from None
    module: ModuleType = build123d
    return module


def _edges(kernel: Any, outline: Outline) -> list[Any]:
    """Return the edges of an outline; a whole circle is one."""
    if outline.circle:
        center, radius = (to_border(value, "length") for value in outline.circle)
        return [kernel.Edge.make_circle(float(radius), kernel.Plane((center.real, center.imag, 0.0)))]
    chain = outline.chain
    nodes = to_border(chain.nodes, "length")
    middles = to_border(
        points_on(chain.nodes[:-1], chain.chords, chain.turns, np.full(len(chain.bulges), 0.5)), "length"
    )
    rise = np.abs(chain.bulges * to_border(chain.chords, "length")) / 2
    found = []
    for k in range(len(middles)):
        a, m, b = ((float(z.real), float(z.imag)) for z in (nodes[k], middles[k], nodes[k + 1]))
        straight = rise[k] < LINE_RISE
        found.append(kernel.Edge.make_line(a, b) if straight else kernel.Edge.make_three_point_arc(a, m, b))
    return found


def _solid(kernel: Any, face: Any, holes: Sequence[Any], sheet: Sheet) -> Any:
    """Return the body on z = 0 of one outline with its holes."""
    usual, other = float(sheet.thickness or 0.0), [one for one in sheet.regions if one.thickness != sheet.thickness]
    whole = _prism(kernel, face, usual)
    around = whole.bounding_box()
    for hole in holes:
        box = hole.bounding_box()
        if (
            around.min.X < box.min.X
            and box.max.X < around.max.X
            and around.min.Y < box.min.Y
            and box.max.Y < around.max.Y
        ):
            face = face - hole
    whole = body = _prism(kernel, face, usual)
    thickest = usual
    for one in sorted(other, key=lambda one: one.thickness):
        stencil = _prism(kernel, _face(kernel, one), 2 * max(usual, one.thickness))
        if not (whole & stencil):
            continue
        thickest = max(thickest, one.thickness)
        body = (body - stencil) + (_prism(kernel, face, one.thickness) & stencil)
    height = float(body.bounding_box().size.Z) * 1e-3
    lift = 0.5 * to_border(min(thickest, height), "length")
    return body.moved(kernel.Location((0.0, 0.0, float(lift))))


def _prism(kernel: Any, face: Any, thickness: float) -> Any:
    """Return a face extruded to both sides of the plane, by a thickness [m] in all."""
    height = float(to_border(thickness, "length"))
    return kernel.Solid.extrude(face, kernel.Vector(0, 0, height)).moved(kernel.Location((0.0, 0.0, -0.5 * height)))


def _face(kernel: Any, region: Region) -> Any:
    points = to_border(np.asarray(region.polygon), "length")
    ends = points[:-1] if np.array_equal(points[0], points[-1]) else points
    return kernel.Face(kernel.Wire.make_polygon([tuple(map(float, point)) for point in ends]))


def _write_step(kernel: Any, whole: Any) -> bytes:
    """Return a STEP file whose head names no date and no folder: the same part gives the same bytes."""
    try:
        with tempfile.TemporaryDirectory(prefix="cfmkit-") as folder:
            path = Path(folder) / "part.step"
            kernel.export_step(whole, str(path))
            text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise OutputError(f"STEP needs a temporary folder for a moment: {error}; set TMPDIR to one") from error
    text = re.sub(r"(NEXT_ASSEMBLY_USAGE_OCCURRENCE\(')\d+'", r"\g<1>1'", text)  # counts what the process has written
    return re.sub(
        r"FILE_NAME\(.*?\);", "FILE_NAME('','',(''),(''),'cfmkit','','');", text, count=1, flags=re.S
    ).encode()
