"""STL: the triangles of all bodies in millimetres, in the binary form that every slicer reads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.export.extrusion import Body

_HEADER_BYTES = 80
_TRIANGLE_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def stl_bytes(name: str, bodies: Sequence[Body]) -> bytes:
    """Return bodies as one STL file; single precision, as the format has it: 7 digits of a millimetre."""
    corners = np.concatenate([body.corners for body in bodies]).astype("<f4")
    records = np.zeros(len(corners), _TRIANGLE_RECORD)
    records["corners"] = corners
    a, b, c = corners.astype(float).swapaxes(0, 1)
    across = np.cross(b - a, c - a)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    records["normal"] = across / np.where(length > 0, length, 1.0)
    # a head that begins with "solid" would be taken for the text form
    head = f"cfmkit {name}, in mm".encode()[:_HEADER_BYTES].ljust(_HEADER_BYTES)
    return head + len(records).to_bytes(4, "little") + records.tobytes()
