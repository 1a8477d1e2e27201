"""Any request to the services that rclpy gives a node for its parameters, answered by the callbacks that it has made.

What is set is what was asked for, all of it or none; what is refused changes nothing, and says why in one sentence.
"""

import array
import math

import numpy as np
import pytest

from rigid_body_sim import Scene
from rigid_body_sim.scene import schema

from .fuzzing import fuzz, often, sentence

rclpy = pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
srv = pytest.importorskip("rcl_interfaces.srv")
msg = pytest.importorskip("rcl_interfaces.msg")

FIELDS = {  # the field of a ParameterValue that holds a value of each type
    "bool_value": 1,
    "integer_value": 2,
    "double_value": 3,
    "string_value": 4,
    "byte_array_value": 5,
    "bool_array_value": 6,
    "integer_array_value": 7,
    "double_array_value": 8,
    "string_array_value": 9,
}
NUMBERS = [0.0, -0.0, 1.0, 2.0, -1.0, 0.5, 1e308, -1e308, 5e-324, 1e-320, math.inf, -math.inf, math.nan, 1e-101, 1e101]
TEXTS = [
    "",
    " ",
    "box",
    "world",
    "base_link",
    "taylor",
    "auto",
    "a" * 3000,
    "x\x1b[2J\ny",
    "größe",
    "/dev/zero",
    "ä\0b",
]
TETHER = {"tethers.one.anchor": [0.0, 0.0, 2.0], "tethers.one.rest_length": 1.0, "tethers.one.stiffness": 100.0}
FORCE = {"forces.one.force": [0.0, 0.0, 9.0]}
SCENE = {"body.inertia": [0.1, 0.2, 0.25, 0.0, 0.0, 0.0], "start_paused": True, **TETHER, **FORCE}
DYNAMIC = [name for name in schema.read(SCENE) if schema.find(name).dynamic]
NAMES = [
    *schema.defaults(),
    "use_sim_time",
    "start_type_description_service",
    "qos_overrides./parameter_events.publisher.depth",
]
NAMES += [
    "",
    ".",
    "body",
    "body.maas",
    "frames.a.axes",
    "tethers.two.anchor",
    "a" * 3000,
    "x\ny",
    "drag.linear ",
    "größe",
]


def integer(chance):
    return chance.choice((0, 1, 2, -1, 2**63 - 1, -(2**63), chance.getrandbits(40)))


def double(chance):
    return chance.choice(NUMBERS) if chance.random() < 0.4 else chance.uniform(-3.0, 9.0)


def entries(chance, make):
    return [make(chance) for _ in range(chance.choice((0, 1, 2, 3, 3, 3, 4, 6, 6, 7, 30)))]


MAKE = {
    "bool_value": lambda chance: chance.random() < 0.5,
    "integer_value": integer,
    "double_value": double,
    "string_value": lambda chance: chance.choice(TEXTS),
    "byte_array_value": lambda chance: entries(chance, lambda c: bytes([c.getrandbits(8)])),
    "bool_array_value": lambda chance: entries(chance, lambda c: c.random() < 0.5),
    "integer_array_value": lambda chance: array.array("q", entries(chance, integer)),
    "double_array_value": lambda chance: array.array("d", entries(chance, double)),
    "string_array_value": lambda chance: entries(chance, lambda c: c.choice(TEXTS)),
}
USUAL = {bool: "bool_value", float: "double_value", tuple: "double_array_value"}


def parameter(chance):
    """A name and a value that might go together, or two that do not."""
    name = chance.choice(DYNAMIC if often(chance) else NAMES)
    field = USUAL.get(schema.find(name).type) if name in DYNAMIC and often(chance) else None
    field = field or chance.choice(list(FIELDS))
    kind = FIELDS[field] if chance.random() < 0.97 else chance.choice((0, 10, 255, *FIELDS.values()))
    return name, kind, field, MAKE[field](chance)


def request(chance):
    return chance.random() < 0.7, [parameter(chance) for _ in range(chance.choice((0, 1, 1, 1, 2, 2, 3, 5)))]


@pytest.fixture(scope="module")
def node():
    from rigid_body_sim.ros.node import RigidBodyNode

    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--log-level", "error"], context=context)
    given = [rclpy.Parameter(name, value=value) for name, value in SCENE.items()]
    node = RigidBodyNode(context=context, parameter_overrides=given)
    yield node
    node.destroy_node()
    context.try_shutdown()


def held(node):
    return {name: repr(p.value) for name, p in node._parameters.items()}


def messages_of(parameters):
    return [
        msg.Parameter(name=name, value=msg.ParameterValue(type=kind, **{field: value}))
        for name, kind, field, value in parameters
    ]


def call(node, together, parameters):
    """Results, one for each parameter or one for all; None when rclpy refuses the request as a whole."""
    service = node._parameter_service
    try:
        if together:
            asked = srv.SetParametersAtomically.Request(parameters=parameters)
            response = srv.SetParametersAtomically.Response()
            return [service._set_parameters_atomically_callback(asked, response).result]
        asked = srv.SetParameters.Request(parameters=parameters)
        return service._set_parameters_callback(asked, srv.SetParameters.Response()).results
    except ValueError:  # RigidBodyNode.run logs it and goes on; nobody gets an answer
        assert any(p.value.type > 9 for p in parameters)
        return None


def same(found, asked):
    """Whether a value is the one asked for: numbers as floats, where those are meant."""
    if isinstance(found, float):
        return found == float(asked)
    if isinstance(found, (list, tuple, array.array)):
        return list(found) == [float(x) if not isinstance(x, str) else x for x in asked]
    return found == asked


def test_requests(record_property, node):
    started, refused = held(node), []

    def check(case):
        together, parameters = case
        before, simulation = held(node), node.simulation.save()
        results = call(node, together, messages_of(parameters))
        after = held(node)
        if results is None:
            return
        for result in results:
            if not result.successful:
                sentence(result.reason)
                refused.append(result.reason)
        if not any(result.successful for result in results):
            assert after == before and node.simulation.save() == simulation
        if together and results[0].successful:
            for asked in map(rclpy.Parameter.from_parameter_msg, {p.name: p for p in messages_of(parameters)}.values()):
                assert same(node.get_parameter(asked.name).value, asked.value)
        check_consistent(node, after)

    fuzz(record_property, check, request, 400)
    assert refused and held(node) != started


def check_consistent(node, parameters):
    """Scene, parameters and simulation say the same."""
    assert set(parameters) >= set(schema.defaults())
    scene = node.scene
    for name in DYNAMIC:
        assert same(node.get_parameter(name).value, scene[name]), name
    assert node.simulation.body == scene.body()
    assert node.simulation.gravity.tolist() == list(scene["gravity"])
    assert (node.simulation.tethers, node.simulation.forces) == (scene.effect("tethers"), scene.effect("forces"))
    assert np.isfinite(node.simulation.motion).all()


def scene_of(chance):
    """Parameters by name as any program might hand them over."""
    names = list(schema.defaults()) if often(chance) else NAMES
    values = (
        None,
        1,
        True,
        10**400,
        b"\0\1\2",
        {1.0, 2.0},
        {"a": 1},
        (),
        [[1.0]],
        "x",
        object,
        1j,
        np.float32(1.0),
        np.eye(3),
    )
    given = {}
    for _ in range(chance.randint(1, 4)):
        name = chance.choice(names)
        given[name] = MAKE[chance.choice(list(FIELDS))](chance) if often(chance) else chance.choice(values)
    return given


def test_scenes_from_any_mapping(record_property):
    def check(given):
        try:
            scene = Scene(given, "/nowhere")
        except ValueError as reason:
            sentence(reason)
            return
        assert set(scene.values) >= set(schema.defaults())
        assert Scene(scene.values, "/nowhere").values == scene.values

    fuzz(record_property, check, scene_of, 400)
