"""The equations that heyoka is given: the cheapest form found for each problem, where products of states are the cost.

Two axes of a frame that stands still are states, as the body sees them. The torque of a force that keeps its direction
is linear in one of them, and where a force turns with the body they lead to its place with fewer products than a
quaternion. What is known in closed form is left out: the way under a constant acceleration, an angular momentum that no
torque changes, the spin of a symmetric body.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rigid_body_sim.kernels.vectors import qmultiply, qrotate, qrotate_back
from rigid_body_sim.report.problems import End, Problem
from rigid_body_sim.values.rotation import normalize
from rigid_body_sim.values.wrench import Wrench

IDENTITY = [1.0, 0.0, 0.0, 0.0]
NEXT = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


class Equations:
    """Those of a problem, with the start of their states, the parameters of each wrench, and the end that states tell.

    The frame's third axis is the world's, along which forces that keep their direction act in every problem, or that of
    the angular momentum where no torque changes it. The states, each if it is needed: ω, the frame's first and third
    axis, velocity and position; these in the frame, or where there is drag as the body sees them.

    Attributes
    ----------
    system : list of (state, slope)
    start : list of float
    parameters : list of arrays, one for each wrench
    signs : list of (state, place)
        Velocities and the parameters that are their signs: what has to change when they pass zero.
    """

    def __init__(self, problem: Problem):
        self.system: list[tuple[Any, Any]] = []
        self.start: list[float] = []
        self.signs: list[tuple[Any, int]] = []
        self._columns: list[Sequence[float]] = []  # of each parameter, its value under each wrench
        self._problem, self._moments = problem, problem.body.principal_moments.tolist()
        self._turns = problem.fastest_rate > 0.0
        self._kept: list[float] = []  # a spin that is no state
        self._free = self._turns and not (problem.dragged or any(map(_torque, problem.wrenches)))
        self._q = normalize(problem.initial.orientation).tolist()
        self._frame = self._along_momentum() if self._free else IDENTITY
        w, first, third = self._turning() if self._turns else ([], [0.0] * 3, [0.0] * 3)
        if problem.dragged:
            self._move_seen(w, third)
        elif not self._turns or any(any(wrench.values[:3]) for wrench in problem.wrenches):
            self._move(first, third)
        self.parameters = [np.array(row) for row in zip(*self._columns, strict=True)] or [np.array([])]

    def _along_momentum(self) -> list[float]:
        """Quaternion that leads from the third axis to the angular momentum, or against it if that points down."""
        momentum = np.array(qrotate(*self._q, *(self._moments * self._problem.initial.angular_velocity)))
        self._size = math.copysign(math.hypot(*momentum), momentum[2])
        x, y, z = (momentum / self._size).tolist()
        return normalize((1.0 + z, -y, x, 0.0)).tolist()

    def _states(self, name: str, start: Sequence[float]) -> list[Any]:
        from heyoka import make_vars

        self.start += start
        return list(make_vars(*(f"{name}{i}" for i in range(len(start)))))

    def _parameter(self, values: Sequence[float]) -> Any:
        from heyoka import par

        self._columns.append(values)
        return par[len(self._columns) - 1]

    def _held(self, numbers: Callable[[Wrench], Sequence[float]]) -> list[Any]:
        """Parameters that follow the wrench; 0 for a number that is zero under every one."""
        columns = zip(*map(numbers, self._problem.wrenches), strict=True)
        return [self._parameter(column) if any(column) else 0.0 for column in columns]

    def _turning(self) -> tuple[list[Any], list[Any], list[Any]]:
        """The equations of ω and of the two axes, all three of which are returned."""
        moments = self._moments
        torque = self._held(lambda wrench: [a / b for a, b in zip(wrench.values[3:6], moments, strict=True)])
        lever = self._held(_lever)
        w = self._rates(torque, lever)
        first = self._states("a", self._seen((1.0, 0.0, 0.0)))
        third = self._momentum(w) if self._free else self._states("c", self._seen((0.0, 0.0, 1.0)))
        pull, drag = _cross(lever, third), self._drag(w, self.start[:3], 2, moments)
        slopes = [
            (moments[j] - moments[k]) / moments[i] * w[j] * w[k] + torque[i] + pull[i] / moments[i] - drag[i]
            for i, j, k in NEXT
        ]
        rates = 3 - len(self._kept)
        self.system += zip(w[:rates], slopes[:rates], strict=True)
        self.system += zip(first, _cross(first, w), strict=True)
        if not self._free:
            self.system += zip(third, _cross(third, w), strict=True)
        return w, first, third

    def _rates(self, torque: Sequence[Any], lever: Sequence[Any]) -> list[Any]:
        """ω as states; the third is a parameter for a symmetric body without torque about its axis."""
        rates, moments = self._problem.initial.angular_velocity.tolist(), self._moments
        acting = self._problem.dragged or any(not isinstance(n, float) for n in (torque[2], *lever[:2]))
        self._kept = rates[2:] if moments[0] == moments[1] and not acting else []
        w = self._states("w", rates[: 3 - len(self._kept)])
        return [*w, *(self._parameter([rate] * len(self._problem.wrenches)) for rate in self._kept)]

    def _momentum(self, w: Sequence[Any]) -> list[Any]:
        """The frame's third axis as the body sees it, from ω."""
        return [moment / self._size * rate for moment, rate in zip(self._moments, w, strict=True)]

    def _seen(self, axis: Sequence[float]) -> Sequence[float]:
        """An axis of the frame as the body sees it at the start."""
        return qrotate_back(*self._q, *list(qrotate(*self._frame, *axis)))

    def _drag(self, along: Sequence[Any], start: Sequence[float], row: int, inertia: Sequence[float]) -> list[Any]:
        """What drag takes from the slopes of three velocities; ``row`` is where its coefficients begin."""
        if not self._problem.dragged:
            return [0.0] * 3
        linear, quadratic = np.reshape(self._problem.drag.values, (4, 3))[row : row + 2].tolist()
        signs = [self._sign(v, begin) for v, begin in zip(along, start, strict=True)]
        return [(linear[i] + quadratic[i] * signs[i] * along[i]) / inertia[i] * along[i] for i in range(3)]

    def _sign(self, velocity: Any, start: float) -> Any:
        self.signs.append((velocity, len(self._columns)))
        return self._parameter([math.copysign(1.0, start)] * len(self._problem.wrenches))

    def _move_seen(self, w: Sequence[Any], third: Sequence[Any]) -> None:
        """The equations of velocity and position as the body sees them."""
        initial, mass = self._problem.initial, self._problem.body.mass
        start = qrotate_back(*self._q, *initial.velocity)
        v, x = self._states("v", start), self._states("x", qrotate_back(*self._q, *initial.position))
        force, pull, drag = self._held(self._force), self._held(self._pull)[2], self._drag(v, start, 0, [mass] * 3)
        slopes = [a + b + pull * c - d for a, b, c, d in zip(_cross(v, w), force, third, drag, strict=True)]
        self.system += zip(v, slopes, strict=True)
        self.system += [(a, b + c) for a, b, c in zip(x, _cross(x, w), v, strict=True)]

    def _move(self, first: Sequence[Any], third: Sequence[Any]) -> None:
        """The equations of velocity and position in the frame."""
        initial, force = self._problem.initial, self._held(self._force)
        v = self._states("v", qrotate_back(*self._frame, *initial.velocity))
        x = self._states("x", qrotate_back(*self._frame, *initial.position))
        turned = _dot(first, force), _dot(third, _cross(first, force)), _dot(third, force)
        self.system += [(a, b + c) for a, b, c in zip(v, turned, self._held(self._pull), strict=True)]
        self.system += zip(x, v, strict=True)

    def _force(self, wrench: Wrench) -> list[float]:
        return [force / self._problem.body.mass for force in wrench.values[:3]]

    def _pull(self, wrench: Wrench) -> Sequence[float]:
        """Acceleration in the frame by what keeps its direction."""
        return qrotate_back(*self._frame, *self._acceleration(wrench))

    def _acceleration(self, wrench: Wrench) -> list[float]:
        forces = [wrench.values[6:9], *(force for _, force in wrench.points)]
        return [g + sum(f[i] for f in forces) / self._problem.body.mass for i, g in enumerate(self._problem.gravity)]

    def end(self, states: Sequence[float]) -> End:
        """The end of the problem that the last states tell."""
        w, q, rest = self._end_of_turning(states)
        axes = q if self._problem.dragged else self._frame
        if rest:
            return End(qrotate(*axes, *rest[3:]), q, qrotate(*axes, *rest[:3]), w)
        initial, t, a = self._problem.initial, self._problem.duration, self._acceleration(self._problem.wrenches[0])
        velocity = [v + t * b for v, b in zip(initial.velocity.tolist(), a, strict=True)]
        way = [t * (v - t / 2 * b) for v, b in zip(velocity, a, strict=True)]
        return End([x + d for x, d in zip(initial.position.tolist(), way, strict=True)], q, velocity, w)

    def _end_of_turning(self, states: Sequence[float]) -> tuple[Sequence[float], Sequence[float], Sequence[float]]:
        """ω, attitude, and the states that are left."""
        if not self._turns:
            return self._problem.initial.angular_velocity.tolist(), self._q, states
        rates = 3 - len(self._kept)
        w, first, rest = [*states[:rates], *self._kept], states[rates : rates + 3], states[rates + 3 :]
        third, rest = (self._momentum(w), rest) if self._free else (rest[:3], rest[3:])
        return w, qmultiply(*self._frame, *_quaternion((first, _cross(third, first), third))), rest


def _torque(wrench: Wrench) -> bool:
    return bool(wrench.points) or any(wrench.values[3:6])


def _lever(wrench: Wrench) -> list[float]:
    """The l of which l × third axis is the torque of forces at points, along that axis."""
    return [sum(force[2] * point[i] for point, force in wrench.points) for i in range(3)]


def _cross(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _quaternion(rows: Sequence[Sequence[float]]) -> Sequence[float]:
    """That of a rotation matrix: the row of 4 q qᵀ with the largest diagonal entry, made a unit."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    found = (
        (1.0 + a + e + i, h - f, c - g, d - b),
        (h - f, 1.0 + a - e - i, b + d, c + g),
        (c - g, b + d, 1.0 - a + e - i, f + h),
        (d - b, c + g, f + h, 1.0 - a - e + i),
    )
    q = max(enumerate(found), key=lambda row: row[1][row[0]])[1]
    size = math.hypot(*q)
    return [component / size for component in q]
