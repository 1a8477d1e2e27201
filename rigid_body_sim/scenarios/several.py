"""A bag of several bodies as the bag of each: its topics, and its part of the journal."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeVar, overload

from ..bags import journal as journals
from ..bags.reading import Bag
from ..bags.rosbags_support import BagError
from ..scene.fleet import FleetScene
from ..scene.loader import Scene
from ..values.parameter import shown

Found = TypeVar("Found")


def of_body(bag: Bag, scene: FleetScene, name: str) -> Bag:
    """What a bag holds of one body, as if a node of that body alone had recorded it.

    Raises BagError for a bag without a topic of that body, and ValueError for a name of none.
    """
    if name not in scene.names:
        raise ValueError(f"no body is called {shown(name)}; the bodies are {', '.join(scene.names)}")
    kept = {topic: kind for topic, kind in bag.types.items() if _is_of(topic, scene, name)}
    if not kept:
        raise BagError(f"{bag.path}: has no topic of the body {name}, whose names have /{name}/ before the last part")

    def part(topics: dict[str, Found]) -> dict[str, Found]:
        return {topic: found for topic, found in topics.items() if topic in kept}

    return replace(
        bag,
        wrenches=part(bag.wrenches),
        poses=part(bag.poses),
        twists=part(bag.twists),
        numbers=part(bag.numbers),
        counts=part(bag.counts),
        types=kept,
        journal=_journal(bag, scene, name),
        notes=list(bag.notes),
    )


@overload
def each(bag: Bag, scene: Scene | FleetScene, wanted: Sequence[str] = ()) -> Iterator[tuple[str, Bag, Scene]]: ...
@overload
def each(
    bag: Bag, scene: Scene | FleetScene | None, wanted: Sequence[str] = ()
) -> Iterator[tuple[str, Bag, Scene | None]]: ...
def each(
    bag: Bag, scene: Scene | FleetScene | None, wanted: Sequence[str] = ()
) -> Iterator[tuple[str, Bag, Scene | None]]:
    """Name, bag and scene of each body that is wanted, or of all; of an only one what is given, without a name.

    Raises ValueError for a name that is wanted where there is but one body, and as ``of_body`` does.
    """
    if not isinstance(scene, FleetScene):
        if wanted:
            raise ValueError(f"body {shown(wanted[0])}: there is but one body, which has no name; leave this one out")
        yield "", bag, scene
        return
    for name in wanted or scene.names:
        yield name, of_body(bag, scene, name), scene.scenes[name]


def chosen(bag: Bag, scene: Scene | FleetScene, body: str | None) -> tuple[Bag, Scene]:
    """Bag and scene of the only body, or of the one that is named. Raises ValueError where that does not say which."""
    found = list(each(bag, scene, () if body is None else (body,)))
    if len(found) != 1:
        names = ", ".join(name for name, *_ in found)
        raise ValueError(f"{bag.path}: is of several bodies, {names}; choose one (body)")
    return found[0][1:]


def _is_of(topic: str, scene: FleetScene, name: str) -> bool:
    """Whether a topic is in the namespace of a body; sources of wrenches may have a place of their own."""
    return topic.split("/")[-2] == name or topic in scene.scenes[name]["wrench.topics"]


def _journal(bag: Bag, scene: FleetScene, name: str) -> list[str]:
    """The entries of one body, and those of all; the scene is that of the body."""
    if not bag.journal:
        return []
    first, *entries = journals.read(bag.journal)
    parameters = journals.scene_values(scene.scenes[name], first.values["epoch_ns"])["parameters"]
    begin = journals.text(first.time_ns, first.step, first.call, {**first.values, "parameters": parameters})
    return [begin, *(_text(entry) for entry in entries if entry.body in ("", name))]


def _text(entry: journals.Entry) -> str:
    return json.dumps({"time_ns": entry.time_ns, "step": entry.step, "call": entry.call, **entry.values})
