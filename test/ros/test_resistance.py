"""Drag, tethers and constant forces of a parameter file reach the node, its parameters and its diagnostics."""

import math

import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

RATE, MASS, DRAG = 100.0, 2.0, 4.0
SCENE = {
    "rate": RATE,
    "publish_rate": 0.0,
    "start_paused": True,
    "gravity": [0.0, 0.0, -10.0],
    "body.mass": MASS,
    "drag.linear": [DRAG, DRAG, DRAG],
    "tethers.line.anchor": [0.0, 0.0, -3.0],
    "tethers.line.rest_length": 2.0,
    "tethers.line.stiffness": 6.0,
    "tethers.line.slack": False,
    "forces.lift.force": [0.0, 0.0, 26.0],
    "forces.lift.body_point": [0.0, 0.0, 0.5],
    "integrator.name": "rosenbrock",
    "integrator.rtol": 1e-8,
}


@pytest.fixture(scope="module")
def node(connect_shared):
    return connect_shared(SCENE).ready()


def test_they_are_parameters(node):
    names = ["drag.linear", "drag.quadratic", "tethers.line.stiffness", "tethers.line.damping", "tethers.line.slack"]
    linear, quadratic, *line = node.get_parameters(*names)
    assert (list(linear), list(quadratic), line) == ([DRAG] * 3, [0.0] * 3, [6.0, 0.0, False])
    point, rtol = node.get_parameters("forces.lift.body_point", "integrator.rtol")
    assert (list(point), rtol) == ([0.0, 0.0, 0.5], 1e-8)


def test_potential_energy_is_that_of_gravity_spring_and_lift(node):
    """At the origin: ½ k s² = 3 J of a line stretched by 1 m, and −f·p = −13 J."""
    node.call("reset")
    assert float(node.report()[1]["potential energy [J]"]) == 3.0 - 13.0


def test_lift_less_weight_and_the_pull_of_the_line_meet_at_rest(node):
    """26 N up, 20 N down, 6 N/m: equilibrium at z = 0, where it starts; a blow of 4 N s upwards swings back to it.

    m z'' = −c z' − k z with c = 4 and k = 6: damped at 1/s, so after 1 s e^(−t) (J/m) sin(√2 t) / √2 is left.
    """
    node.call("reset")
    node.send("world", (0.0, 0.0, 4.0), topic="impulse")
    node.wait_report(lambda _, values: values["momentum [kg m/s]"] == "[0.0, 0.0, 4.0]", "the blow")
    node.clear()
    for _ in range(100):
        node.call("step")
    heights = node.collect(100).position[:, 2]
    times = [(k + 1) / RATE for k in range(100)]
    expected = [4.0 / MASS * math.exp(-t) * math.sin(math.sqrt(2.0) * t) / math.sqrt(2.0) for t in times]
    assert heights == pytest.approx(expected, rel=0, abs=1e-7)  # m; measured 3.9e-11
