"""Scenes of several bodies: parameters of one body stand under its name, what all share without it."""

import copy
import difflib
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

from ..effects import link
from ..effects.link import Link
from ..values.parameter import Parameter, shown
from . import attitude, mass_source, parameter_file, plan, schema
from .loader import DEFAULT_NODE, Scene, log_notes

COUNT = "bodies.count"
# Parameters of the loop, and of what all bodies have around them: none of them stands under a body's name.
OF_ALL = (
    "rate",
    "publish_rate",
    "real_time_factor",
    "realtime_priority",
    "lockstep",
    "steps_per_command",
    "start_paused",
    "reset_time",
    "world_frame_id",
)
GROUPS_OF_ALL = (*schema.OF_SEVERAL, "record")
TAKEN = (  # last parts of topics and services of a node, which no body may have for a name
    *("pose", "twist", "impulse", "set_pose", "set_twist", "fluid_velocity", "actuator_commands", "journal"),
    *("reset", "pause", "step", "clear_wrench"),
)

MOST_TOLD = 12  # names of bodies in a message
CLOCK = "clock"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
Given = dict[str, Any]


def is_several(given: Mapping[str, Any]) -> bool:
    """Whether parameters by dotted name, as they were given, name or count several bodies."""
    return bool(given.get("bodies")) or bool(given.get(COUNT))


def by_body(given: Mapping[str, Any]) -> dict[str, Given]:
    """Of the parameters of several bodies, by dotted name, those of each, as a Scene takes them, by its name.

    Raises ValueError for names that cannot be those of bodies, and for a parameter of none of them.
    """
    names = _names(given)
    return _each(names, *_sorted_out(given, names))


def links_of(given: Mapping[str, Any]) -> tuple[Link, ...]:
    """What parameters, by dotted name, describe of links between bodies. Raises ValueError as Link does."""
    values = schema.read({key: value for key, value in given.items() if key.startswith("links.")})
    return link.read(values, partial(schema.members, names=values))


class FleetScene:
    """Checked parameters of several bodies, and the Scene of each by its name.

    What is given for one, ``{"red": {"initial": {...}}}``, goes over what is given for all, ``{"initial": {...}}``.
    The frames of a body have its name in front, ``red/base_link``. The bodies are named, ``bodies: [red, blue]``, or
    counted, ``bodies: {count: 50}``, and then stand in a grid from ``initial.position`` on.

    Raises ValueError, with a sentence that names the parameter, as Scene does, for names that are none or clash, and
    for a parameter of all bodies that stands under the name of one.
    """

    def __init__(self, given: Mapping[str, Any], folder: str | os.PathLike[str] = ""):
        flat = schema.flat(given)
        self.names = _names(flat)
        if not self.names:
            raise ValueError("no bodies are named; give bodies: [red, blue], or bodies.count, or take a Scene for one")
        self._shared, self._own = _sorted_out(flat, self.names)
        files: mass_source.Files = {}
        self.scenes = {
            name: self._told(name, partial(Scene, part, folder, files=files))
            for name, part in _each(self.names, self._shared, self._own).items()
        }
        self.notes = tuple(dict.fromkeys(note for scene in self.scenes.values() for note in scene.notes))
        self.awaited = self._awaited()
        self.links = self._links()

    def __getitem__(self, name: str) -> Any:
        """The value of a parameter of all bodies."""
        return self.first[name]

    @property
    def first(self) -> Scene:
        """The scene of the first body, whose values of what all share are those of all."""
        return self.scenes[self.names[0]]

    @property
    def steps_per_publish(self) -> int:
        """As of a Scene."""
        return self.first.steps_per_publish

    def has(self, name: str) -> bool:
        """Whether there is a parameter of that name: of all, or under its name of a body."""
        body, key = split(name, self.names)
        return (_placed(body, key) if body else key) in (self.scenes[body] if body else self).values

    def value_of(self, name: str) -> Any:
        """The value of a parameter under a body's name."""
        body, key = split(name, self.names)
        return self.scenes[body].values[_placed(body, key)]

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name in the table, without a body's. Raises ValueError when there is none."""
        body, key = split(name, self.names)
        if body and is_of_all(key):
            raise ValueError(f"parameter {name}: is the same for all bodies; give {key} without a body's name")
        return schema.find(key)

    def changed(self, changes: Mapping[str, Any]) -> "FleetScene":
        """The scene with other values; those for all change every body that has none of its own. Raises ValueError."""
        shared, own = _sorted_out(schema.flat(changes), self.names)
        other = copy.copy(self)
        other.scenes = dict(self.scenes)
        for name, scene in self.scenes.items():
            meant = {key: value for key, value in shared.items() if key not in self._own[name]} | own[name]
            if meant:
                other.scenes[name] = self._told(name, partial(scene.changed, meant))
        other._shared = {**self._shared, **shared}
        other._own = {name: {**self._own[name], **own[name]} for name in self.names}
        return other

    @property
    def values(self) -> dict[str, Any]:
        """All values by dotted name: of all bodies, and of each what was given for it, and what may change if named."""
        values = dict(self._values_of_all())
        for name, scene in self.scenes.items():
            dynamic = () if self._are_counted else self.dynamic(name)
            for key in dict.fromkeys((*self._own[name], *dynamic)):
                values[f"{name}.{key}"] = scene.values[_placed(name, key)]
        return values

    @property
    def _are_counted(self) -> bool:
        return COUNT in self._shared

    def dynamic(self, name: str) -> list[str]:
        """The parameters of a body that may be set while the node runs, without its name."""
        return [key for key in self.scenes[name].values if schema.find(key).dynamic and not is_of_all(key)]

    def _values_of_all(self) -> Iterator[tuple[str, Any]]:
        """Of a parameter that is the same for every body its value, also where it follows from others; else as given.

        A member of a group of which each body has its own part is left to them.
        """
        for key, value in self.first.values.items():
            if schema.is_open(key):
                continue
            alike = not key.startswith("bodies") and all(one[key] == value for one in self.scenes.values())
            given = self._shared.get(key, schema.BY_NAME[key].default)
            yield key, value if alike else schema.BY_NAME[key].read(key, given)
        for key, value in self._shared.items():
            if schema.is_open(key):
                yield key, schema.find(key).read(key, value)

    def parameters(self, but: tuple[str, ...]) -> Given:
        """What a FleetScene of the same is made from, without files: all values of each body ``but`` those names."""
        shared = {key: self.first[key] for key in self.first.values if is_of_all(key)}
        shared = {key: value for key, value in shared.items() if not key.startswith("bodies.")}
        shared |= {key: value for key, value in self._shared.items() if key.startswith("links.")}
        shared["bodies"], shared["lockstep_on"] = self.names, self.awaited or schema.LEADING[:1]
        own = {}
        for name, scene in self.scenes.items():
            own.update({f"{name}.{key}": value for key, value in scene.values.items() if not is_of_all(key)})
            own[f"{name}.outputs"] = [one for one in scene["outputs"] if one != CLOCK]
            if CLOCK in scene["outputs"]:
                shared["outputs"] = (CLOCK,)
        return {key: value for key, value in {**shared, **own}.items() if split(key, self.names)[1] not in but}

    def _awaited(self) -> tuple[str, ...]:
        """The bodies that lockstep_on names. Raises ValueError for what is no body."""
        for body, own in self._own.items():
            for name in _named_in(own):
                raise ValueError(
                    f"parameter {body}.lockstep_on: {shown(name)} says for whom all wait; give it in lockstep_on "
                    f"without a body's name, and here {' or '.join(schema.LEADING)}"
                )
        named = _named_in(self._shared)
        for name in named:
            if name not in self.names:
                raise ValueError(
                    f"parameter lockstep_on: {shown(name)} is no body; give names of bodies ({_some(self.names)}) "
                    f"or which commands lead ({' or '.join(schema.LEADING)})"
                )
        return named

    def _links(self) -> tuple[Link, ...]:
        """What holds bodies together. Raises ValueError for what is between bodies that are none."""
        links = links_of(self._shared)
        bodies = {name: scene.body() for name, scene in self.scenes.items()}
        for one in links:
            link.row(one, bodies)
            for name in one.bodies:
                if (asked := self.scenes[name]["integrator.name"]) != plan.LINKED:
                    raise ValueError(
                        f"parameter integrator.name = {shown(asked)}: {name} has links, and bodies with links are "
                        f"advanced by {plan.LINKED!r}; leave it out"
                    )
        return links

    def _told(self, name: str, make: Callable[[], Scene]) -> Scene:
        """What ``make`` makes; a parameter that it finds bad is told under the body's name where it stands there."""
        try:
            return make()
        except ValueError as reason:
            raise ValueError(_under(name, str(reason).replace(f"frames.{name}/", "frames."), self._own[name])) from None


def scene_from(given: Mapping[str, Any], folder: str | os.PathLike[str] = "") -> Scene | FleetScene:
    """The scene of one body, or that of several. Raises ValueError as both do."""
    flat = schema.flat(given)
    return FleetScene(flat, folder) if is_several(flat) else Scene(flat, folder)


def by_name(scene: Scene | FleetScene) -> dict[str, Scene]:
    """The scene of each body by its name, which is empty where there is but one."""
    return {"": scene} if isinstance(scene, Scene) else scene.scenes


def load_fleet(path: str | os.PathLike[str], node: str = DEFAULT_NODE) -> FleetScene:
    """The scene of several bodies in a ROS parameter file; see loader.load_scene, and raises as that does."""
    scene = load_any(path, node)
    if isinstance(scene, Scene):
        raise ValueError(f"{os.fspath(path)}: names no bodies; give bodies: [red, blue], or read it with load_scene")
    return scene


def load_any(path: str | os.PathLike[str], node: str = DEFAULT_NODE) -> Scene | FleetScene:
    """The scene of one body or of several in a ROS parameter file, as load_scene or load_fleet; raises as they do."""
    given = parameter_file.of_scene(path, node)
    try:
        scene = scene_from(given)
    except ValueError as reason:
        raise ValueError(f"{os.fspath(path)}: {schema.one_line(reason)}") from None
    log_notes(path, scene.notes)
    return scene


def is_of_all(key: str) -> bool:
    """Whether a parameter is the same for all bodies, whatever they are."""
    return key in OF_ALL or key.split(".")[0] in GROUPS_OF_ALL


def split(name: str, names: tuple[str, ...]) -> tuple[str, str]:
    """The body under whose name a parameter stands, or "", and the parameter."""
    first, _, rest = name.partition(".")
    return (first, rest) if rest and first in names else ("", name)


# Names ----------------------------------------------------------------------------------------------------------------


def _names(given: Mapping[str, Any]) -> tuple[str, ...]:
    """The names of the bodies. Raises ValueError for what names none, or clashes."""
    table = schema.BY_NAME
    names = table["bodies"].read("bodies", given.get("bodies", ()))
    count = table[COUNT].read(COUNT, given.get(COUNT, 0))
    if names and count:
        raise ValueError(f"parameters bodies and {COUNT} are given; name the bodies, or count them")
    for key in given:
        if key.startswith("bodies.") and not count:
            raise ValueError(f"parameter {schema.shown_name(key)} is for counted bodies; give {COUNT}, too")
    prefix = table["bodies.prefix"].read("bodies.prefix", given.get("bodies.prefix", table["bodies.prefix"].default))
    for name in names or (prefix,):
        _check_name(name, "bodies" if names else "bodies.prefix")
    return names or tuple(f"{prefix}{i}" for i in range(count))


def _check_name(name: str, parameter: str) -> None:
    if not _NAME.fullmatch(name) or "__" in name:
        raise ValueError(
            f"parameter {parameter}: {shown(name)} cannot be the name of a body, which is part of those of topics; "
            "give letters, digits and single '_', a letter first"
        )
    groups = {*schema.OF_SEVERAL, *(known.split(".")[0] for known in schema.BY_NAME)}
    for taken, what in ((groups, "a parameter"), ({*TAKEN, *schema.OUTPUTS}, "a topic or service")):
        if name in taken:
            raise ValueError(
                f"parameter {parameter}: a body cannot be called {name!r}, which is the name of {what}; give another"
            )


def _sorted_out(given: Mapping[str, Any], names: tuple[str, ...]) -> tuple[Given, dict[str, Given]]:
    """Parameters of all, and those of each body without its name. Raises ValueError for what is neither."""
    shared, own = Given(), {name: Given() for name in names}
    groups = {known.split(".")[0] for known in schema.BY_NAME}
    for key, value in given.items():
        name, rest = split(key, names)
        if not name:
            if key.split(".")[0] not in groups:
                raise ValueError(_unknown(key, names))
            shared[key] = value
        elif is_of_all(rest):
            raise ValueError(
                f"parameter {schema.shown_name(key)}: is the same for all bodies; give {rest} without a body's name"
            )
        else:
            own[name][rest] = value
    return shared, own


def _unknown(key: str, names: tuple[str, ...]) -> str:
    """The sentence for a parameter under a name that is none: a body's, misspelt, or one of all."""
    first, _, rest = key.partition(".")
    if not rest and first in names:
        return f"parameter {key}: is the name of a body; its parameters stand below it, such as {key}.initial.position"
    if rest and schema.is_known(rest):
        near = difflib.get_close_matches(first, names, 1, 0.6)
        meant = f"did you mean {near[0]}.{rest}?" if near else f"the bodies are {_some(names)}"
        return f"parameter {schema.shown_name(key)} is not known; no body is called {shown(first)}: {meant}"
    return schema.unknown(key, key, schema.BY_NAME)


def _some(names: tuple[str, ...]) -> str:
    more = [f"{len(names) - MOST_TOLD} more"] if len(names) > MOST_TOLD else []
    return ", ".join([*names[:MOST_TOLD], *more])


def _under(name: str, reason: str, own: Given) -> str:
    """What is wrong with a body's scene: a parameter that stands under its name is told there."""
    begin = re.match(r"(parameters?) ([^\s,:]+)", reason)
    if begin is None:
        return f"body {name}: {reason}"
    if begin[2] not in own:
        return reason
    told = re.sub(r"(did you mean|given without) (?=\S+\.)", rf"\1 {name}.", reason[begin.start(2) :])
    return f"{begin[1]} {name}.{told}"


def _each(names: tuple[str, ...], shared: Given, own: Mapping[str, Given]) -> dict[str, Given]:
    """What the Scene of each body is made from, by its name."""
    linked = _linked(shared)
    return {
        name: _of_body(name, shared, own[name], place, is_last=place == len(names) - 1, is_linked=name in linked)
        for place, name in enumerate(names)
    }


def _of_body(name: str, shared: Given, own: Given, place: int, *, is_last: bool, is_linked: bool) -> Given:
    """What a Scene of one body is made from."""
    of_bodies = {key: value for key, value in shared.items() if key.split(".")[0] not in schema.OF_SEVERAL}
    given = attitude.over(of_bodies, own)
    if is_linked and given.get("integrator.name", "auto") == "auto":
        given["integrator.name"] = plan.LINKED
    given["lockstep_on"] = _leading(given)
    if clocked := _outputs(shared, own, is_last):
        given["outputs"] = clocked
    if COUNT in shared and "initial.position" not in own:
        given["initial.position"] = _in_grid(place, shared)
    for sensor in schema.members("sensors", given):
        if (key := f"sensors.{sensor}.seed") not in own:  # so that each body has noise of its own
            given[key] = schema.find(key).read(key, given.get(key, 0)) + place
    frame = given.get("body.frame_id", schema.BY_NAME["body.frame_id"].default)
    if isinstance(frame, str) and frame.strip():
        given["body.frame_id"] = _own_frame(name, frame)
    return {_placed(name, key): value for key, value in given.items()}


def _placed(name: str, key: str) -> str:
    """What a parameter of a body is called in its Scene, where its frames have its name in front."""
    group, _, rest = key.partition(".")
    return f"frames.{_own_frame(name, rest)}" if group == "frames" and rest else key


def _own_frame(name: str, frame: str) -> str:
    return frame if frame.startswith(f"{name}/") else f"{name}/{frame}"


def _linked(shared: Given) -> set[str]:
    """Names in what links are between: such bodies are advanced together, in one way."""
    known = schema.BY_NAME["links.<name>.bodies"]
    return {
        name
        for key, value in shared.items()
        if key.startswith("links.") and key.endswith(".bodies")
        for name in known.read(key, value)
    }


def _leading(given: Given) -> Any:
    """The kinds of commands among what lockstep_on has; of the bodies there FleetScene takes care."""
    return tuple(one for one in _lockstep_on(given) if one in schema.LEADING) or schema.LEADING[:1]


def _named_in(given: Given) -> tuple[str, ...]:
    """What lockstep_on has beside the kinds of commands."""
    return tuple(one for one in _lockstep_on(given) if one not in schema.LEADING)


def _lockstep_on(given: Given) -> tuple[str, ...]:
    known = schema.BY_NAME["lockstep_on"]
    names: tuple[str, ...] = known.read(known.name, given.get(known.name, known.default))
    return names


def _outputs(shared: Given, own: Given, is_last: bool) -> Any:
    """There is one clock, sent after the other messages of a step: by the last body."""
    outputs = schema.BY_NAME["outputs"]
    of_all = outputs.read("outputs", shared.get("outputs", ()))
    mine = outputs.read("outputs", own.get("outputs", of_all))
    if CLOCK in own.get("outputs", ()):
        raise ValueError("parameter outputs: there is one clock for all bodies; give it without a body's name")
    clock = (CLOCK,) if is_last and CLOCK in of_all else ()
    return (*(output for output in mine if output != CLOCK), *clock)


def _in_grid(place: int, shared: Given) -> Any:
    """Where a counted body stands: in rows from the position of all on."""
    table = schema.BY_NAME
    count, columns, spacing, start = (
        table[key].read(key, shared.get(key, table[key].default))
        for key in (COUNT, "bodies.columns", "bodies.spacing", "initial.position")
    )
    row, column = divmod(place, columns or math.ceil(math.sqrt(count)))
    return start[0] + column * spacing[0], start[1] + row * spacing[1], start[2]
