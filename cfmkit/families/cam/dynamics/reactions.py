"""Forces at contacts and pins of the nine-coordinate model, from its Lagrange multipliers.

The rows of the closure and of rolling act where roller and flank touch, so that the cam
pushes the roller with -(lambda_x, lambda_y) - lambda_roll (dx/dy, 1). The pins follow from the
balance of roller and brace. Left vectors are given as on the right, in a mirror.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.dynamics.constraints import Chain, Posture
    from cfmkit.families.cam.dynamics.multibody import NineCoordinates, Trajectory
    from cfmkit.families.cam.dynamics.side import Parts

    ComplexArray = NDArray[np.complex128]


class Reactions(NamedTuple):
    """Of one side, each (n,), x outwards.

    `center` of the roller [m], normal `contact` force and `traction` along the way up [N], force on the
    brace at the roller and at the slider [N], `spin` of the roller, positive on the way up [rad/s].
    """

    center: ComplexArray
    contact: FloatArray
    traction: FloatArray
    roller_pin: ComplexArray
    slider_pin: ComplexArray
    spin: FloatArray


def reactions(model: NineCoordinates, found: Trajectory) -> tuple[Reactions, Reactions]:
    """Return the reactions on the right and on the left."""
    machine, x = model.machine, found.coordinates
    right, left = (chain.length * np.exp(1j * x[:, chain.columns.start]) for chain in model.chains)
    distance = np.abs(right - left)
    pull = machine.stiffness * np.maximum(distance - machine.rest_length, 0.0) * (right - left) / distance
    first, second = (_side(model, found, index, spring) for index, spring in enumerate((-pull, -pull.conj())))
    return first, second


def _side(model: NineCoordinates, found: Trajectory, index: int, springs: ComplexArray) -> Reactions:
    chain, posture, parts = model.chains[index], found.postures[index], model.sides[index].parts
    push = _contact_force(chain, posture, found.multipliers)
    tangent = (posture.flank.first + 1j) / np.sqrt(1.0 + posture.flank.first**2)
    arm, bent = _brace(chain, parts, found)
    lift = 1j * (found.accelerations[:, 0] + model.machine.gravity)
    roller_pin = push + springs - parts.roller_mass * (bent + lift)
    return Reactions(
        center=1j * found.coordinates[:, 0] + arm,
        contact=(push * (-1j * tangent).conj()).real,
        traction=(push * tangent.conj()).real,
        roller_pin=roller_pin,
        slider_pin=parts.brace_mass * (0.5 * bent + lift) - roller_pin,
        spin=chain.hand * found.velocities[:, chain.columns.start + 1],
    )


def _contact_force(chain: Chain, posture: Posture, multipliers: FloatArray) -> ComplexArray:
    """Return the force of the cam on the roller [N]."""
    i, j, _, roll = chain.rows
    force = -(multipliers[:, i] + 1j * multipliers[:, j])
    force = force - multipliers[:, roll] * (chain.hand * posture.flank.first + 1j)
    return _as_on_the_right(chain, force)


def _brace(chain: Chain, parts: Parts, found: Trajectory) -> tuple[ComplexArray, ComplexArray]:
    """Return the brace from slider to roller [m] and its second time derivative [m/s^2]."""
    column = chain.columns.start
    angle, rate = found.coordinates[:, column], found.velocities[:, column]
    arm = parts.brace_length * np.exp(1j * angle)
    bent = arm * (1j * found.accelerations[:, column] - rate * rate)
    return _as_on_the_right(chain, arm), _as_on_the_right(chain, bent)


def _as_on_the_right(chain: Chain, vector: ComplexArray) -> ComplexArray:
    return vector if chain.hand > 0 else -vector.conj()
