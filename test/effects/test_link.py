"""Links as values: what they are made of, how they are read, what they refuse, their energy, and the law of springs."""

import numpy as np
import pytest

from rigid_body_sim import Body, State
from rigid_body_sim.effects import link, spring, tether
from rigid_body_sim.effects.link import Link

pytestmark = pytest.mark.no_numba

BODIES = {"drone": Body(1.0, (0.1, 0.1, 0.1)), "load": Body(2.0, (0.2, 0.2, 0.2), (0.0, 0.1, 0.0))}
ROPE = Link("rope", ["drone", "load"], [(0.0, 0.0, -0.1), (0.0, 0.3, 0.0)], 1.0, 200.0, 3.0)


def test_row_has_places_points_from_the_centres_of_mass_and_the_spring():
    assert link.row(ROPE, BODIES).tolist() == pytest.approx(
        [0.0, 1.0, 0.0, 0.0, -0.1, 0.0, 0.2, 0.0, 1.0, 200.0, 3.0, 1.0], abs=1e-15
    )
    assert len(link.row(ROPE, BODIES)) == link.SIZE


@pytest.mark.parametrize(("height", "stored"), [(-2.0, 0.5 * 200.0 * 0.9**2), (-0.5, 0.0)])
def test_energy_is_that_of_the_stretch_and_none_when_slack(height, stored):
    """The points are 0.1 m below the one origin and 0.3 m beside the other, which lies 0.3 m to the other side."""
    ends = State(), State((0.0, -0.3, height))
    found = link.energy(ROPE, BODIES["drone"], ends[0], BODIES["load"], ends[1])
    assert found == pytest.approx(stored, abs=1e-12)


def test_parameters_read_give_the_link():
    values = {"bodies": ("drone", "load"), "first_point": (0.0, 0.0, -0.1), "second_point": (0.0, 0.3, 0.0)}
    values |= {"rest_length": 1.0, "stiffness": 200.0, "damping": 3.0, "slack": True}
    given = {f"links.rope.{name}": value for name, value in values.items()}
    assert link.read(given, lambda group: ["rope"] if group == "links" else []) == (ROPE,)
    assert {row.name.replace("<name>", "rope") for row in link.PARAMETERS} == given.keys()


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"bodies": ("drone", "drone")}, "link rope: both ends are on 'drone'; give two bodies"),
        ({"bodies": ("drone",)}, r"link rope: bodies \['drone'\]; give names of two bodies"),
        ({"bodies": "drone"}, "link rope: bodies 'drone'; give names of two bodies"),
        ({"points": ((0.0, 0.0, 0.0),)}, r"link rope: points \[\[0.0, 0.0, 0.0\]\]; give two points"),
        ({"points": ((0.0, 0.0, 0.0), (0.0, np.nan, 0.0))}, "link rope: second point"),
        ({"stiffness": -1.0}, "link rope: stiffness -1 is not a finite number of at least 0"),
        ({"damping": np.inf}, "link rope: damping inf is not a finite number of at least 0"),
    ],
)
def test_what_is_no_link_is_refused_in_a_sentence(changed, said):
    given = {"bodies": ROPE.bodies, "points": ROPE.points, "rest_length": 1.0, "stiffness": 200.0}
    with pytest.raises(ValueError, match=said):
        Link("rope", **{**given, **changed})


def test_body_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(ValueError, match=r"link rope: there is no body 'load'; there are drone"):
        link.row(ROPE, {"drone": BODIES["drone"]})


@pytest.mark.parametrize(
    ("length", "rate", "slack", "tension"),
    [(1.5, 2.0, 1.0, 106.0), (1.5, -40.0, 1.0, 0.0), (0.5, 50.0, 1.0, 0.0), (0.5, 2.0, 0.0, -94.0)],
)
def test_tension_is_stretch_and_rate_and_a_rope_never_pushes(length, rate, slack, tension):
    assert spring.tension(np.array([9.0, 1.0, 200.0, 3.0, slack]), 1, length, rate) == tension


def test_tethers_and_links_describe_the_spring_alike():
    of_tether = {row.name.split(".")[-1]: row.text for row in tether.EFFECT.parameters}
    for row in link.PARAMETERS:
        if (name := row.name.split(".")[-1]) in (*spring.NUMBERS, "slack"):
            assert row.text == of_tether[name]
