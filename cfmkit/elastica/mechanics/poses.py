"""Places of the attachments of a network: X = origin + R(frame) (x, y) + R(rotation) arm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.numerics.dual_array import cos_sin, stack

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Attachments


class AttachmentPoses(NamedTuple):
    """Places of k attachments and what moves them; d2X/drotation2 = -arm."""

    place: Any  # (..., k, 2)
    arm: Any  # (..., k, 2) turned
    frame: Any  # (..., k, 2)
    unknowns: Any  # (k, 4)

    @property
    def jacobian(self) -> Any:
        """Derivatives of the places by x, y and rotation, (..., k, 2, 3)."""
        cos, sin = self.frame[..., 0], self.frame[..., 1]
        jacobian = np.empty((*self.place.shape, 3), np.result_type(self.arm, cos))
        jacobian[..., 0, 0], jacobian[..., 0, 1], jacobian[..., 0, 2] = cos, -sin, -self.arm[..., 1]
        jacobian[..., 1, 0], jacobian[..., 1, 1], jacobian[..., 1, 2] = sin, cos, self.arm[..., 0]
        return jacobian

    def works(self, force: Any) -> Any:
        """Return the works of forces (..., k, 2) per unit of x, y and rotation, (..., k, 3)."""
        fx, fy = force[..., 0], force[..., 1]
        cos, sin = self.frame[..., 0], self.frame[..., 1]
        return stack([fx * cos + fy * sin, fy * cos - fx * sin, fy * self.arm[..., 0] - fx * self.arm[..., 1]])


def poses(attachments: Attachments, z: Any, which: Any) -> AttachmentPoses:
    """Return the poses of attachments at the values of all unknowns, (size,) or of several states (n, size)."""
    unknowns, frame = attachments.unknowns[which], attachments.frame[which]
    cos, sin = frame[:, 0], frame[:, 1]
    x, y, turn = z[..., unknowns[:, 0]], z[..., unknowns[:, 1]], z[..., unknowns[:, 2]]
    ax, ay = attachments.arm[which][:, 0], attachments.arm[which][:, 1]
    c, s = cos_sin(turn)
    arm = stack([c * ax - s * ay, s * ax + c * ay])
    place = stack([cos * x - sin * y, sin * x + cos * y]) + attachments.origin[which] + arm
    return AttachmentPoses(place, arm, frame, unknowns)
