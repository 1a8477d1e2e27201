"""Links: a spring and damper between a point of one body and a point of another.

It is no effect of one body, so the registry does not have it: see integrators.linked for what advances such bodies.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..kernels.arrays import Floats, Vector
from ..kernels.compiled import kernel
from ..kernels.tuples import NOTHING, Load, Motion, Vec, crossed, dot, minus, plus, rotate, scaled, vec
from ..values import rotation
from ..values.body import Body
from ..values.parameter import NAMES, Parameter, is_array, shown
from ..values.state import Motions
from ..values.wrench import ZERO, three_finite
from . import spring

# Places of the two bodies in a list of them; their points, 3 each, from the centre of mass, body axes; then the spring.
FIRST, SECOND, _FIRST_POINT, _SECOND_POINT, _SPRING = 0, 1, 2, 5, 8
SLACK = _SPRING + spring.SLACK
SIZE = _SPRING + spring.SIZE


@dataclass(frozen=True)
class Link:
    """A spring and damper between two bodies, from a point of the first to a point of the second.

    ``bodies`` are their names, ``points`` [m] are each in the axes of its body, from the origin of the body's frame.
    The tension is stiffness [N/m] times what the length exceeds rest_length [m], plus damping [N s/m] times the rate of
    lengthening. With ``slack`` it pulls only while stretched, and never pushes. Raises ValueError for bodies that are
    not two, for points that are not, and for a number that is negative or not finite.
    """

    name: str
    bodies: tuple[str, str]
    points: tuple[Vector, Vector] = (ZERO, ZERO)
    rest_length: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    slack: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "bodies", self._two("bodies", "names of two bodies, such as ['drone', 'load']"))
        if not all(isinstance(one, str) for one in self.bodies):
            raise ValueError(f"link {self.name}: bodies {shown(list(self.bodies))} are no names; give texts")
        points = self._two("points", "two points, [x, y, z] each: one of the first body, one of the second")
        if self.bodies[0] == self.bodies[1]:
            raise ValueError(f"link {self.name}: both ends are on {shown(self.bodies[0])}; give two bodies")
        finite = (three_finite(one, f"link {self.name}: {end} point") for end, one in zip(_ENDS, points, strict=True))
        object.__setattr__(self, "points", tuple(finite))
        spring.check(self, f"link {self.name}:")

    def _two(self, field: str, rule: str) -> tuple[Any, ...]:
        given = getattr(self, field)
        if not is_array(given) or len(given) != len(_ENDS):
            raise ValueError(f"link {self.name}: {field} {shown(given)}; give {rule}")
        return tuple(given)


_ENDS = ("first", "second")


def row(link: Link, bodies: Mapping[str, Body]) -> Floats:
    """Its numbers for kernels, shape (SIZE,); it names bodies by their places in ``bodies``.

    Raises ValueError, naming those there are, for a body that is none of them.
    """
    places = []
    for name in link.bodies:
        if name not in bodies:
            raise ValueError(f"link {link.name}: there is no body {shown(name)}; there are {', '.join(bodies)}")
        places.append(list(bodies).index(name))
    arms = (
        np.subtract(point, bodies[name].center_of_mass) for name, point in zip(link.bodies, link.points, strict=True)
    )
    return np.array((*places, *np.concatenate(list(arms)), *spring.numbers(link)), float)


def energy(link: Link, body_a: Body, state_a: Motions, body_b: Body, state_b: Motions) -> Any:
    """½ k s² [J] of the stretch s, of one pair of states or of many; see values.state.Motions."""
    first, second = (
        state.position.astype(np.longdouble) + rotation.rotate_each(state.orientation, np.asarray(point, float))
        for state, point in zip((state_a, state_b), link.points, strict=True)
    )
    return spring.energy(link, first - second)


def read(values: Mapping[str, Any], members: Callable[[str], Sequence[str]]) -> tuple[Link, ...]:
    """The links that parameters of a scene describe; ``members(group)``: names of the user's in a group, in order."""
    found = []
    for name in members("links"):
        given = {one: values[f"links.{name}.{one}"] for one in ("bodies", *spring.NUMBERS, "slack")}
        points = tuple(values[f"links.{name}.{end}_point"] for end in _ENDS)
        found.append(Link(name, points=points, **given))
    return tuple(found)


class Ends(NamedTuple):
    """What a link does to its two bodies: force [N] and torque [N m] about each centre of mass, world axes."""

    first: Load
    second: Load


class _Pull(NamedTuple):
    """Arms of the two points, world axes; the unit vector from the second to the first; the tension [N]."""

    first: Vec
    second: Vec
    n: Vec
    tension: float


@kernel
def _pull(links: Floats, at: int, a: Motion, b: Motion) -> _Pull:
    """How the link at ``links[at]`` pulls; at length zero there is no direction and no force."""
    r, s = rotate(a.q, vec(links, at + _FIRST_POINT)), rotate(b.q, vec(links, at + _SECOND_POINT))
    away = plus(minus(a.x, b.x), minus(r, s))
    length = math.sqrt(dot(away, away))
    if length == 0.0:
        return _Pull(r, s, NOTHING, 0.0)
    n = Vec(away.x / length, away.y / length, away.z / length)
    rate = dot(n, minus(plus(a.v, crossed(a.w, r)), plus(b.v, crossed(b.w, s))))
    return _Pull(r, s, n, spring.tension(links, at + _SPRING, length, rate))


@kernel
def link_loads(links: Floats, at: int, a: Motion, b: Motion) -> Ends:
    """What the link at ``links[at]`` does to the first body, which moves as a, and to the second, which moves as b."""
    pull = _pull(links, at, a, b)
    force = scaled(-pull.tension, pull.n)
    back = scaled(pull.tension, pull.n)
    return Ends(Load(force, crossed(pull.first, force)), Load(back, crossed(pull.second, back)))


@kernel
def pulls(links: Floats, at: int, a: Motion, b: Motion) -> bool:
    """Whether it does anything, as a spring always does, and a rope while it is taut."""
    return links[at + SLACK] == 0.0 or _pull(links, at, a, b).tension > 0.0


PARAMETERS = (
    Parameter("links.<name>.bodies", NAMES, ("drone", "load"), "The two bodies that a link is between.", required=True),
    *(
        Parameter(
            f"links.<name>.{end}_point",
            tuple,
            ZERO,
            f"Where it is fastened to the {end} of them, from the origin of that body's frame, in its axes.",
            "m",
            length=3,
        )
        for end in _ENDS
    ),
    *spring.parameters("links", dynamic=False),
)
