"""Ground of a parameter file: a body falls on it, it moves while the node runs, and it is never taken away."""

import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

MASS, G, STIFFNESS = 2.0, 10.0, 4000.0
SCENE = {
    "rate": 100.0,
    "publish_rate": 0.0,
    "start_paused": True,
    "gravity": [0.0, 0.0, -G],
    "body.mass": MASS,
    "initial.position": [0.0, 0.0, 0.2],
    "ground.stiffness": STIFFNESS,
    "ground.damping": 200.0,
    "contacts.foot.position": [0.0, 0.0, -0.1],
}
SUNK = MASS * G / STIFFNESS  # m


@pytest.fixture(scope="module")
def node(connect_shared):
    return connect_shared(SCENE).ready()


def height_after(node, steps):
    node.clear()
    for _ in range(steps):
        assert node.call("step").success
    return node.collect(steps).position[-1, 2]


def test_body_falls_on_the_ground_and_rises_with_it(node):
    """To where its weight is held, and 1 cm above that when the ground is higher, from one step to the next."""
    node.fresh()
    assert height_after(node, 100) == pytest.approx(0.1 - SUNK, abs=1e-9)
    assert float(node.report()[1]["potential energy [J]"]) == pytest.approx(
        MASS * G * (0.1 - SUNK) + STIFFNESS * SUNK**2 / 2, abs=1e-9
    )
    answer = node.set_together({"ground.height": 0.01, "ground.friction": 0.2})
    assert answer.successful, answer.reason
    assert height_after(node, 100) == pytest.approx(0.11 - SUNK, abs=1e-9)


def test_ground_is_not_taken_from_under_the_feet(node):
    """What would let the body fall through is refused, and so are contacts that move."""
    kept = node.get_parameters("ground.friction", "ground.stiffness")
    answer = node.set_together({"ground.friction": 0.7, "ground.stiffness": 0.0})
    assert not answer.successful and "holds none of the 1 contacts; give one above 0" in answer.reason
    assert node.get_parameters("ground.friction", "ground.stiffness") == kept and kept[1] == STIFFNESS
    answer = node.set_together({"contacts.foot.position": [0.0, 0.0, 0.0]})
    assert not answer.successful and "is read at start only" in answer.reason
