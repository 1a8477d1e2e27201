"""What is compiled before it is needed: what a scene's plan needs by two processes, and the rest by one that is niced.

The cache of the kernels is where they meet; without one each process compiles for itself, when it needs something.
Nothing else is done meanwhile in place of a kernel: results never depend on what was in the cache.
"""

import contextlib
import ctypes
import functools
import itertools
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from . import fleet_links, groups, integrators, sensors
from .effects import REGISTRY
from .effects.base import DriveEffect, KernelEffect, MediumEffect
from .integrators import linked
from .kernels import compiled
from .kernels import state as flat
from .kernels.acceleration import acceleration_reader
from .kernels.compiled import Request
from .scene import attitude, fleet, schema
from .sensors.instrument import kernels_of
from .stepping import asked_for, request, within_reach
from .terms import Terms
from .values.body import Body

_BODY = Body(1.0, (1.0, 1.0, 1.0))  # any: a plan's integrators do not depend on it
_READERS_OF_ACCELERATION = {"accel", "imu"}  # of the outputs
CARRIED = (0, 1, 3)  # vectors that a wrench may have the series carry: see kernels.model
_SET_NO_PLAN = ("initial.", "body.", "frames.")  # parameters on which no kernel depends
START_TAKES = 3.0  # s, of a node that joins the network, and on two cores needs both
_PR_SET_PDEATHSIG = 1  # of linux/prctl.h
_background: list[threading.Thread] = []


def needed(terms: Terms, integrator: str = integrators.AUTO, acceleration: bool = False) -> list[Request]:
    """What a simulation of these terms may call before they change; what takes longest to compile comes first."""
    steps = [request(one, terms.kernels) for one in within_reach(terms, asked_for(integrator))]
    arrays = np.zeros(flat.SIZE), np.zeros(1)
    readers = [Request(flat.read_motion, arrays)]
    return [
        *steps,
        *readers,
        *([Request(acceleration_reader(terms.kernels), arrays)] if acceleration else []),
    ]


def of_scene(terms: Terms, values: Mapping[str, Any]) -> list[Request]:
    """What a node with these terms needs, by the values of its scene: the integrator, and what is published."""
    kinds = [sensors.REGISTRY[values[f"sensors.{one}.type"]] for one in schema.members("sensors", values)]
    shown = not _READERS_OF_ACCELERATION.isdisjoint(values["outputs"])
    acceleration = shown or any(kind.accelerations for kind in kinds)
    return [*needed(terms, values["integrator.name"], acceleration), *kernels_of(kinds)]


def of_parameters(given: Mapping[str, Any]) -> tuple[list[Request], list[Request]]:
    """What a node with these parameters needs, and what it may need once dynamic ones are set; no file is read.

    Nothing for parameters that are bad: whoever reads them in full says so.
    """
    own = {name: value for name, value in given.items() if not schema.belongs_to_ros(name)}
    now, later = list[Request](), list[Request]()
    try:
        several = fleet.is_several(own)
        if several:
            now += _linked(own)
        for one in _kinds(fleet.by_body(own)) if several else [own]:
            terms, values = _described(one)
            now += [*of_scene(terms, values), *([groups.REDUCING] if several else [])]
            later += together(terms, values["integrator.name"]) if several else []
            later += [one for other in _reached_by_setting(terms) for one in of_scene(other, values)]
    except (ValueError, KeyError):
        return [], []
    return now, later


def _linked(given: Mapping[str, Any]) -> list[Request]:
    """What advances the bodies that links hold together."""
    bodies, links = fleet.by_body(given), fleet.links_of(given)
    sets = fleet_links.sets_of(list(bodies), links) if links else ()
    return [linked.request(tuple(_described(bodies[name])[0].kernels for name in held.names)) for held in sets]


def _kinds(bodies: Mapping[str, Mapping[str, Any]]) -> Iterable[Mapping[str, Any]]:
    """Of the parameters of bodies those that differ in more than where a body is, and what it is made of."""
    kinds = {}
    for given in bodies.values():
        kinds[repr([(name, value) for name, value in given.items() if not name.startswith(_SET_NO_PLAN)])] = given
    return kinds.values()


def _described(given: Mapping[str, Any]) -> tuple[Terms, Mapping[str, Any]]:
    """Of a scene's parameters: terms with any body, and all values."""
    values = attitude.read(given)
    members = functools.partial(schema.members, names=values)
    effects = {effect.name: effect.read(values, members) for effect in REGISTRY.values()}
    return Terms(_BODY, **effects), values


def together(terms: Terms, integrator: str = integrators.AUTO) -> list[Request]:
    """What a fleet may call for many bodies of these terms."""
    methods = within_reach(terms, asked_for(integrator))
    found = [groups.request_of(one, terms.kernels, None) for one in methods]
    if integrators.taylor.INTEGRATOR in methods and not terms.actuated:
        found += [groups.request_of(integrators.taylor.INTEGRATOR, terms.kernels, carried) for carried in CARRIED]
    return found


def _reached_by_setting(terms: Terms) -> Iterator[Terms]:
    """Terms in which one dynamic effect comes or goes: none is added to those with names, and some always act.

    A medium has no kernel but of what cannot be set.
    """
    for effect in REGISTRY.values():
        acts = bool(terms.acting[effect.name])
        is_there = bool(terms.given[effect.name]) if effect.many else not effect.groups
        comes_and_goes = is_there and not isinstance(effect, MediumEffect)
        if effect.dynamic and comes_and_goes and not (acts and effect.acts(effect.zero)):
            yield terms.changed(**{effect.name: effect.absent if acts else effect.present})


def everything() -> list[Request]:
    """What any scene needs in which at most two kinds of load act, or all, or actuators and at most one kind.

    Every integrator, every reader.
    """
    loads, drives = (
        [name for name, effect in REGISTRY.items() if isinstance(effect, kind)] for kind in (KernelEffect, DriveEffect)
    )
    chosen = {one for count in (0, 1, 2, len(loads)) for one in itertools.combinations(loads, count)}
    chosen |= {(drive, *one) for drive in drives for one in chosen if len(one) < 2}
    all_terms = [Terms(_BODY, **{name: REGISTRY[name].present for name in names}) for names in sorted(chosen)]
    requests = kernels_of(sensors.REGISTRY.values())
    requests += [Request(flat.read_pose, (np.zeros(flat.SIZE), np.zeros(1)))]
    for terms in all_terms:
        methods = [name for name in integrators.REGISTRY if not integrators.shortfall(name, terms)]
        requests += [each for name in methods for each in needed(terms, name, acceleration=True)]
    return [*requests, *together(Terms(_BODY))]


def missing(requests: Iterable[Request]) -> list[Request]:
    """Those that are not compiled yet, each once."""
    return list({one.function: one for one in requests if not one.is_met}.values())


def compile_together(requests: Iterable[Request], meanwhile: Callable[[], object] = lambda: None) -> None:
    """Compile what is missing, half of it in a child where there is a second core and a place to meet.

    The first takes longest (see ``needed``), so the next two go to the child; while that is not done, ``meanwhile``.
    """
    left = missing(requests)
    alone = not compiled.FOLDER or len(os.sched_getaffinity(0)) < 2
    others = [one for k, one in enumerate(left) if not alone and k % 4 in (1, 2)]
    child = _in_child(others) if others else None
    for k, one in enumerate(left):
        if alone or k % 4 in (0, 3):
            compiled.ready(one.function, *one.examples)
    meanwhile()
    if child is not None:
        os.waitpid(child, 0)


def compile_in_background(requests: Iterable[Request]) -> int | None:
    """Compile what is missing in a child of the lowest priority, which leaves a start alone; see ``wait``.

    To be called before there are threads. Returns the number of the child's process; None where nothing is missing.
    """
    left = missing(requests)
    if not left or not compiled.FOLDER:
        return None
    child = _in_child(left, niceness=19, after=START_TAKES)
    thread = threading.Thread(target=os.waitpid, args=(child, 0), daemon=True)
    thread.start()
    _background.append(thread)
    return child


def wait() -> None:
    """Wait for what is compiled in the background."""
    while _background:
        _background.pop().join()


def _end_with_parent() -> None:
    """Where Linux can: a node that ended has nothing left behind."""
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _in_child(requests: Iterable[Request], niceness: int = 0, after: float = 0.0) -> int:
    """Process number of a child that compiles them into the cache and ends; it says nothing, and is heard by nobody."""
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if child:
        return child
    try:
        _end_with_parent()
        os.nice(niceness)
        nowhere = os.open(os.devnull, os.O_RDWR)
        for descriptor in range(3):
            os.dup2(nowhere, descriptor)
        time.sleep(after)
        for one in requests:
            compiled.ready(one.function, *one.examples)
    finally:
        os._exit(0)
