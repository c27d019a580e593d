"""Where the attachments of a network are: X = origin + R(frame) (x, y) + R(rotation) arm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Attachments


class AttachmentPoses(NamedTuple):
    """Places of k attachments and what moves them; dX/d(x, y, rotation) is the jacobian, d2X/drotation2 = -arm."""

    place: Any  # (..., k, 2)
    arm: Any  # (..., k, 2) turned
    jacobian: Any  # (..., k, 2, 3)
    unknowns: Any  # (k, 4)


def poses(attachments: Attachments, z: Any, which: Any) -> AttachmentPoses:
    """Return the poses of attachments at the values of all unknowns, (size,) or of several states (n, size).

    Attachments of several designs have axes before their own, (d, 1, k, 2).
    """
    unknowns = attachments.unknowns[which]
    cos, sin = np.moveaxis(attachments.frame[..., which, :], -1, 0)
    x, y, turn = z[..., unknowns[:, 0]], z[..., unknowns[:, 1]], z[..., unknowns[:, 2]]
    ax, ay = np.moveaxis(attachments.arm[..., which, :], -1, 0)
    arm = np.stack([np.cos(turn) * ax - np.sin(turn) * ay, np.sin(turn) * ax + np.cos(turn) * ay], axis=-1)
    place = attachments.origin[..., which, :] + np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1) + arm
    jacobian = np.empty((*place.shape, 3), np.result_type(arm, cos))
    jacobian[..., 0, 0], jacobian[..., 0, 1], jacobian[..., 0, 2] = cos, -sin, -arm[..., 1]
    jacobian[..., 1, 0], jacobian[..., 1, 1], jacobian[..., 1, 2] = sin, cos, arm[..., 0]
    return AttachmentPoses(place, arm, jacobian, unknowns)
