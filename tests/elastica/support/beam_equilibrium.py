"""A network's equilibrium stated again, from the answers of a path: Reissner's equations, forces on every body."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from cfmkit.elastica import LineSpring, Loading, Path, PointLoad, SlideSpring, TorsionSpring
from cfmkit.elastica.mechanics.polynomials import basis
from cfmkit.elastica.results.beam_states import elements_of, states, unloaded_places
from cfmkit.elastica.results.path import N_PLACES


def parameters(path: Path, beam: str) -> np.ndarray:
    """Return the parameters of a beam's shape at its sampled places: evenly spaced on each element."""
    share = np.linspace(0.0, 1.0, N_PLACES)
    cuts = path.mesh.elements.cuts[elements_of(path.mesh, beam)]
    return np.concatenate([left + (right - left) * share for left, right in cuts])


def mean_motion(path: Path, beam: str) -> np.ndarray:
    """Return the integral of the displacements along a beam at every point, (n, 2) [m^2]."""
    places, own = basis(path.mesh.degree).places, elements_of(path.mesh, beam)
    weights = path.mesh.elements.weight[own].ravel() * path.mesh.scales.length
    now, rest = states(path.network, path.at, beam, places), unloaded_places(path.network, path.at, beam, places)
    return np.stack([(now.x - rest[:, 0]) @ weights, (now.y - rest[:, 1]) @ weights], axis=1)


class Judge:
    """What is out of balance at one point of a path, from its answers alone."""

    def __init__(self, path: Path, point: int) -> None:
        self.path, self.point, self.network = path, point, path.network
        self.beams = list(self.network.beams)
        self.moved = {name: path.motion(name)[point] for name in self.network.nodes}
        drive = path.load_case
        self.loads: list[tuple[Any, float]] = [(load, 1.0) for load in self.network.loads]
        if isinstance(drive, Loading):
            self.loads += [(load, float(path.drive[point])) for load in drive.loads]

    def now(self, node: str, arm: Any = (0.0, 0.0)) -> np.ndarray:
        """Return where the end of an arm of a node is now [m]."""
        turn = self.moved[node][2]
        c, s = np.cos(turn), np.sin(turn)
        there = np.array([self.network.nodes[node].x, self.network.nodes[node].y]) + self.moved[node][:2]
        return there + np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])

    def line_load(self, name: str) -> np.ndarray:
        return sum(
            (factor * np.array([load.wx, load.wy]) for load, factor in self.loads if getattr(load, "beam", "") == name),
            np.zeros(2),
        )

    def gaps(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return by how much a beam's states miss each other and its nodes, (k, 3) [m, m, rad] and [N, N, N m].

        Every sampled state is integrated as far as the next, so that no error grows along a beam.
        """
        beam, t, seen = self.network.beams[name], parameters(self.path, name), self.path.states(name)
        y = np.stack([getattr(seen, one)[self.point] for one in ("x", "y", "turn", "moment", "h", "v")], axis=1)
        ends = np.array([y[k] - self.wanted(name, side, y[k]) for side, k in enumerate((0, -1))])
        one, other = np.arange(len(t) - 1), np.arange(1, len(t))
        apart = t[other] > t[one]
        miss = [ends, (y[other] - y[one])[~apart]]
        one, other = one[apart], other[apart]
        marks = np.union1d(
            self.path.fits[name].course.breaks,
            [self.path.fits[name].parameter(float(f)) for f in beam.section.stations],
        )
        pieces = np.searchsorted(marks, 0.5 * (t[one] + t[other]), side="right") - 1
        for piece in np.unique(pieces):
            own = pieces == piece
            reached = self.carried(
                name, y[one[own]], t[one[own]], t[other[own]], 0.5 * (marks[piece] + marks[piece + 1])
            )
            miss.append(y[other[own]] - reached)
        found = np.concatenate(miss)
        return found[:, :3], found[:, [4, 5, 3]]

    def wanted(self, name: str, side: int, state: np.ndarray) -> np.ndarray:
        """Return the state that a beam has at an end: pose of its node, and the force there."""
        beam = self.network.beams[name]
        node, arm = ((beam.start, beam.start_offset), (beam.end, beam.end_offset))[side]
        h, v, m = self.path.end_force(name, side)[self.point]
        if (beam.start_joint, beam.end_joint)[side] == "pin":
            assert abs(m) < 1e-10
            return np.array([*self.now(node, arm), state[2], m, h, v])
        return np.array([*self.now(node, arm), self.moved[node][2], m, h, v])

    def carried(self, name: str, y: np.ndarray, start: np.ndarray, stop: np.ndarray, inside: float) -> np.ndarray:
        """Return states (k, 6) at `start` integrated to `stop`, on one smooth piece."""
        section, fitted, load = self.network.beams[name].section, self.path.fits[name], self.line_load(name)
        place = float(np.real(fitted.arc(inside)))

        def slope(share: float, flat: np.ndarray) -> np.ndarray:
            _, _, turn, m, h, v = flat.reshape(6, -1)
            t = start + share * (stop - start)
            g = fitted.speed(t, inside) * (stop - start)
            bending, axial, shear = section.rigidities(np.real(fitted.arc(t)), place)
            psi = fitted.angle(t, inside) + turn
            c, s = np.cos(psi), np.sin(psi)
            stretch, slip = 1 + (h * c + v * s) * axial, (v * c - h * s) * shear
            dx, dy = g * (stretch * c - slip * s), g * (stretch * s + slip * c)
            return np.concatenate([dx, dy, g * m / bending, h * dy - v * dx, -g * load[0], -g * load[1]])

        found = solve_ivp(slope, (0.0, 1.0), y.T.ravel(), "DOP853", rtol=1e-11, atol=1e-15)
        return np.asarray(found.y[:, -1].reshape(6, -1).T)

    def pulls(self, name: str) -> list[tuple[str, np.ndarray, np.ndarray, float]]:
        """Return node, place, force and moment of what a beam does to its nodes."""
        beam = self.network.beams[name]
        one, other = (self.path.end_force(name, end)[self.point] for end in (0, 1))
        return [
            (beam.start, self.now(beam.start, beam.start_offset), one[:2], one[2]),
            (beam.end, self.now(beam.end, beam.end_offset), -other[:2], -other[2]),
        ]

    def springs(self) -> list[tuple[str, np.ndarray, np.ndarray, float]]:
        """Return the same for springs."""
        found: list[tuple[str, np.ndarray, np.ndarray, float]] = []
        none = np.zeros(2)
        for spring in self.network.springs:
            if isinstance(spring, TorsionSpring):
                start = 0.0 if spring.start is None else self.moved[spring.start][2]
                moment = spring.stiffness * (self.moved[spring.end][2] - start - spring.free_angle)
                found.append((spring.end, self.now(spring.end), none, -moment))
                if spring.start is not None:
                    found.append((spring.start, self.now(spring.start), none, moment))
            elif isinstance(spring, SlideSpring):
                way = np.array([np.cos(spring.direction), np.sin(spring.direction)])
                went = way @ self.moved[spring.node][:2] - spring.free_displacement
                found.append((spring.node, self.now(spring.node), -spring.stiffness * went * way, 0.0))
            else:
                found += self.line_spring(spring)
        return found

    def line_spring(self, spring: LineSpring) -> list[tuple[str, np.ndarray, np.ndarray, float]]:
        nodes = self.network.nodes
        old = np.array([nodes[spring.start].x, nodes[spring.start].y])
        far = np.array(spring.ground if spring.end is None else [nodes[spring.end].x, nodes[spring.end].y])
        near, there = self.now(spring.start), np.array(spring.ground) if spring.end is None else self.now(spring.end)
        free = np.linalg.norm(far - old) if spring.free_length is None else spring.free_length
        length = np.linalg.norm(there - near)
        force = spring.stiffness * (length - free) * (there - near) / length
        found = [(spring.start, near, force, 0.0)]
        return found if spring.end is None else [*found, (spring.end, there, -force, 0.0)]

    def point_loads(self) -> list[tuple[str, np.ndarray, np.ndarray, float]]:
        found = []
        for load, factor in self.loads:
            if isinstance(load, PointLoad):
                turn = self.moved[load.node][2] if load.follows else 0.0
                c, s = np.cos(turn), np.sin(turn)
                force = factor * np.array([c * load.fx - s * load.fy, s * load.fx + c * load.fy])
                found.append((load.node, self.now(load.node), force, factor * load.moment))
        return found

    def imbalance(self) -> dict[str, np.ndarray]:
        """Return the sums of forces on every master, and of moments on every body that turns by itself."""
        network = self.network
        total = {
            name: self.path.reaction(name)[self.point].copy()
            for name in network.nodes
            if not network.is_moved_by_link(name)
        }
        acts = [act for name in self.beams for act in self.pulls(name)] + self.springs() + self.point_loads()
        for node, place, force, moment in acts:
            master, body = network.master_of(node), network.body_of(node)
            arm = place - self.now(body)
            total.setdefault(body, np.zeros(3))[2] += moment + arm[0] * force[1] - arm[1] * force[0]
            if body != master:  # a pin passes on the force alone
                arm = self.now(body) - self.now(master)
                total[master][2] += arm[0] * force[1] - arm[1] * force[0]
            total[master][:2] += force
        return total
