"""What a node simulates: one body or several, each with its topics and services, and the loop that advances all."""

from collections.abc import Callable, Set
from typing import NamedTuple

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from ..fleet import Fleet
from ..scene.fleet import FleetScene
from ..scene.loader import Scene
from ..simulation import Simulation
from . import recording, services
from .inputs import Commanded, Input, Inputs, topics_of
from .loop import Loop
from .members import Member, Rendezvous
from .outputs import FleetOutputs, Outputs

LOOK_EVERY = 0.1  # s of wall time, in lockstep, between two looks whether somebody has gone for whom a step waits


class Part(NamedTuple):
    """One body; ``name`` is empty where it is the only one, and its topics are in no namespace of their own."""

    name: str
    scene: Scene
    simulation: Simulation
    seen: Commanded  # the loop as the body's inputs see it
    inputs: Inputs


class Plant(NamedTuple):
    """All bodies, and what advances them."""

    loop: Loop[Simulation] | Loop[Fleet]
    outputs: Outputs | FleetOutputs
    parts: tuple[Part, ...]

    @property
    def inputs(self) -> list[Input]:
        """What all bodies listen to."""
        return [each for part in self.parts for each in part.inputs.inputs]


def create(node: Node, scene: Scene | FleetScene) -> Plant:
    """The bodies of a scene, with their topics, and of several the services of each. Raises ValueError."""
    return _one(node, scene) if isinstance(scene, Scene) else _several(node, scene)


def _one(node: Node, scene: Scene) -> Plant:
    simulation = recording.simulation_of(scene)
    outputs = Outputs(node, scene, simulation)
    loop = Loop(scene, simulation, outputs, node.get_logger().error)
    return Plant(loop, outputs, (Part("", scene, simulation, loop, Inputs(node, scene, loop, topics_of(node))),))


def _several(node: Node, scene: FleetScene) -> Plant:
    fleet = recording.fleet_of(scene)
    fleet.go_on_meanwhile()
    each = {name: Outputs(node, one, fleet[name], name) for name, one in scene.scenes.items()}
    outputs = FleetOutputs(each, fleet.stopped)
    loop = Loop(scene, fleet, outputs, node.get_logger().error)
    rendezvous = Rendezvous(scene.awaited, loop.on_command)
    members = {name: Member(name, loop, each[name], rendezvous) for name in fleet}
    taken = topics_of(node)
    parts = [_part(node, scene.scenes[name], name, member, taken) for name, member in members.items()]
    rendezvous.inputs = {part.name: part.inputs for part in parts}
    fleet.on_stop = _telling(node, members)
    if loop.lockstep:
        node.create_timer(LOOK_EVERY, rendezvous.look, clock=Clock(clock_type=ClockType.STEADY_TIME))
    return Plant(loop, outputs, tuple(parts))


def _part(node: Node, scene: Scene, name: str, member: Member, taken: Set[str]) -> Part:
    inputs = Inputs(node, scene, member, taken, name)

    def reset() -> str:
        text = member.reset()
        inputs.forget()
        return text

    services.create_for(node, name, member.simulation, reset)
    return Part(name, scene, member.simulation, member, inputs)


def _telling(node: Node, members: dict[str, Member]) -> Callable[[str], None]:
    """What to do when a body stops: say why, and show where."""

    def on_stop(name: str) -> None:
        member = members[name]
        node.get_logger().error(f"{name} has stopped; {name}/reset starts it afresh: {member.failure}")
        member.publish()

    return on_stop
