"""3MF: bodies in millimetres, each a separate object; a ZIP of three short XML files [3MF core 1.3].

Reference
---------
[3MF core 1.3] 3MF Consortium, 3D Manufacturing Format, Core Specification 1.3.
"""

from __future__ import annotations

import io
import zipfile
from typing import TYPE_CHECKING

from cfmkit.export.layers import check_name
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.export.extrusion import Body

_XML_HEADER = '<?xml version="1.0" encoding="UTF-8"?>\n'
_CORE_NAMESPACE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PACKAGE_NAMESPACE = "http://schemas.openxmlformats.org/package/2006"
_CONTENT_TYPES = (
    f'{_XML_HEADER}<Types xmlns="{_PACKAGE_NAMESPACE}/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)
_PACKAGE_RELATIONS = (
    f'{_XML_HEADER}<Relationships xmlns="{_PACKAGE_NAMESPACE}/relationships"><Relationship '
    f'Target="/3D/3dmodel.model" Id="model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)
_FILE_DATE = (1980, 1, 1, 0, 0, 0)  # of every file in the archive: the same part gives the same bytes


def threemf_bytes(name: str, bodies: Sequence[Body]) -> bytes:
    """Return bodies as a 3MF file."""
    check_name(name, "drawing")
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for path, text in (
            ("[Content_Types].xml", _CONTENT_TYPES),
            ("_rels/.rels", _PACKAGE_RELATIONS),
            ("3D/3dmodel.model", _model(name, bodies)),
        ):
            entry = zipfile.ZipInfo(path, _FILE_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text)
    return file.getvalue()


def _model(name: str, bodies: Sequence[Body]) -> str:
    lines = [f'{_XML_HEADER}<model unit="millimeter" xml:lang="en-US" xmlns="{_CORE_NAMESPACE}">', "<resources>"]
    for number, body in enumerate(bodies, start=1):
        lines += [f'<object id="{number}" type="model" name="{name}-{number}"><mesh>', *_mesh(body), "</mesh></object>"]
    items = "".join(f'<item objectid="{number}"/>' for number in range(1, len(bodies) + 1))
    return "\n".join([*lines, "</resources>", f"<build>{items}</build></model>", ""])


def _mesh(body: Body) -> Iterator[str]:
    yield "<vertices>"
    for x, y, z in to_border(body.points, "length").tolist():
        yield f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>'
    yield "</vertices><triangles>"
    for a, b, c in body.triangles.tolist():
        yield f'<triangle v1="{a}" v2="{b}" v3="{c}"/>'
    yield "</triangles>"
