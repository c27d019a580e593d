"""Positions of the attachments of a network from the values of its unknowns, with derivatives and forces along these.

A body is a node and what rigid links fix to it. An attachment is a point of a body at which a beam ends or a spring, a
load or a contact acts. Its position is

    X = origin + R(frame) (x, y) + R(rotation) arm,

where x, y and rotation are the body's unknowns: its displacement in axes of its own, and its turn. `origin` is the
body's node at rest, `frame` the cosine and sine of the angle of its axes, `arm` leads from that node to the attachment
at rest. R turns by an angle; the unit of length is that of `Discretisation.scales`. Energies, loads and contacts
(`energy`, `terms`, `cfmkit.elastica.contact`) are computed from these positions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.numerics.dual_array import cos_sin, stack

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Attachments


class AttachmentPoses(NamedTuple):
    """Positions of k attachments with what their derivatives need; the second one by the rotation is -arm."""

    place: Any  # (..., k, 2) position X
    arm: Any  # (..., k, 2) from the body's node, turned with the body
    frame: Any  # (k, 2) cosine and sine of the angle of the body's axes
    unknowns: Any  # (k, 4) numbers of x, y, rotation of the body, and of the attachment's own rotation

    @property
    def jacobian(self) -> Any:
        """Derivatives of the positions by x, y and rotation, (..., k, 2, 3)."""
        cos, sin = self.frame[..., 0], self.frame[..., 1]
        jacobian = np.empty((*self.place.shape, 3), np.result_type(self.arm, cos))
        jacobian[..., 0, 0], jacobian[..., 0, 1], jacobian[..., 0, 2] = cos, -sin, -self.arm[..., 1]
        jacobian[..., 1, 0], jacobian[..., 1, 1], jacobian[..., 1, 2] = sin, cos, self.arm[..., 0]
        return jacobian

    def generalised_forces(self, force: Any) -> Any:
        """Return the generalised forces along x, y and rotation, (..., k, 3), of forces there (..., k, 2)."""
        fx, fy = force[..., 0], force[..., 1]
        cos, sin = self.frame[..., 0], self.frame[..., 1]
        return stack([fx * cos + fy * sin, fy * cos - fx * sin, fy * self.arm[..., 0] - fx * self.arm[..., 1]])


def poses(attachments: Attachments, z: Any, which: Any) -> AttachmentPoses:
    """Return the poses of the attachments `which`, at values of all unknowns: (size,), or (n, size) for n states."""
    unknowns, frame = attachments.unknowns[which], attachments.frame[which]
    cos, sin = frame[:, 0], frame[:, 1]
    x, y, turn = z[..., unknowns[:, 0]], z[..., unknowns[:, 1]], z[..., unknowns[:, 2]]
    offsets = attachments.arm[which]
    ax, ay, (c, s) = offsets[:, 0], offsets[:, 1], cos_sin(turn)
    arm = stack([c * ax - s * ay, s * ax + c * ay])
    place = stack([cos * x - sin * y, sin * x + cos * y]) + attachments.origin[which] + arm
    return AttachmentPoses(place, arm, frame, unknowns)
