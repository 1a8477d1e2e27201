"""Attitudes among parameters: a quaternion whose parts have names, or roll, pitch and yaw; not four numbers in a row.

ROS users read such a row as x, y, z, w, others as w, x, y, z: it is refused with both readings.
"""

from collections.abc import Mapping
from typing import Any

from ..values import rotation
from ..values.parameter import Parameter, is_array, shown
from . import schema
from .schema import PARTS

Quaternion = tuple[float, float, float, float]


def read(given: Mapping[str, Any], table: Mapping[str, Parameter] = schema.BY_NAME) -> dict[str, Any]:
    """As schema.read, and the parts of every quaternion that was given as angles.

    Raises ValueError for a quaternion in a row or one that lacks parts, and for an attitude that is given in two ways.
    """
    for name, value in given.items():
        refuse_row(name, value, table)
    values = schema.read(given, table)
    for prefix in [name.removesuffix(".rpy") for name in values if name.endswith(".rpy")]:
        values.update(_followed(prefix, values, given))
    return values


def refuse_row(name: str, value: Any, table: Mapping[str, Parameter] = schema.BY_NAME) -> None:
    """Raise ValueError, with both readings, where ``value`` is an attitude in a row, or another in place of parts."""
    prefix = name.removesuffix(".orientation")
    if (prefix != name or is_array(value)) and schema.has_attitude(prefix, table):
        raise ValueError(_in_a_row(name, prefix, value))


def quaternion(values: Mapping[str, Any], prefix: str) -> Quaternion:
    """The quaternion (w, x, y, z) of an attitude, of any length. Raises ValueError when it has no direction."""
    w, x, y, z = (values[name] for name in _names(prefix))
    try:
        rotation.normalize((w, x, y, z))
    except ValueError as reason:
        raise ValueError(f"parameter {prefix}.orientation: {reason}") from None
    return w, x, y, z


def over(
    given: Mapping[str, Any], changes: Mapping[str, Any], values: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """``given`` with ``changes``, which take the place of what they contradict: angles that of a quaternion.

    With the ``values`` in use, a part of a quaternion keeps the others.
    """
    kept, values = dict(given), values or {}
    for prefix in {name.rpartition(".")[0].removesuffix(".orientation") for name in changes}:
        names, angles = _names(prefix), f"{prefix}.rpy"
        if not changes.keys().isdisjoint(names):
            kept.pop(angles, None)
            kept.update((name, values[name]) for name in names if name in values)
        elif angles in changes:
            kept = {name: value for name, value in kept.items() if name not in names}
    return {**kept, **changes}


def named(values: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters in the journal of an earlier node, where quaternions are w, x, y, z in a row, with named parts."""
    parameters: dict[str, Any] = {}
    for name, value in values.items():
        prefix = name.removesuffix(".orientation")
        if prefix != name and isinstance(value, list) and len(value) == len(PARTS):
            parameters.update(zip(_names(prefix), value, strict=True))
        else:
            parameters[name] = value
    return parameters


def _names(prefix: str) -> tuple[str, ...]:
    return tuple(f"{prefix}.orientation.{part}" for part in PARTS)


def _followed(prefix: str, values: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """What an attitude's own parameters become. Raises ValueError when parts are missing or angles are beside them."""
    names, angles = _names(prefix), f"{prefix}.rpy"
    there = [name for name in names if name in given]
    if there and values[angles]:
        raise ValueError(f"parameters {there[0]} and {angles} are given; an attitude is given once: leave one out")
    if there and len(there) < len(names):
        missing = ", ".join(name for name in names if name not in there)
        raise ValueError(
            f"parameter {there[0]} is given without {missing}; give all four parts, such as {{{_written(PARTS)}}}, "
            f"or {angles}"
        )
    if not values[angles]:
        return {}
    q = rotation.from_roll_pitch_yaw(*values[angles]).tolist()
    return {**dict(zip(names, q, strict=True)), angles: ()}


def _in_a_row(name: str, prefix: str, value: Any) -> str:
    """The sentence for an attitude that is not given by named parts."""
    parts, angles = f"{prefix}.orientation", f"{prefix}.rpy: [roll, pitch, yaw]"
    rule = f"write {parts}: {{{_written(PARTS)}}}, or {angles}"
    if not is_array(value):
        return f"parameter {name} = {shown(value)}: is no attitude; {rule}"
    row = list(value)
    if len(row) != len(PARTS):
        return f"parameter {name} = {shown(row)}: has {len(row)} entries, and an attitude has named parts; {rule}"
    w_last, w_first = (f"{{{_written(dict(zip(order, row, strict=True)))}}}" for order in ("xyzw", "wxyz"))
    return (
        f"parameter {name} = {shown(row)}: does not tell which number is w; as x, y, z, w that is {w_last}; "
        f"as w, x, y, z it is {w_first}; write {parts}: with the one that is meant, or {angles}"
    )


def _written(parts: Mapping[str, Any]) -> str:
    return ", ".join(f"{part}: {shown(parts[part])}" for part in PARTS)
