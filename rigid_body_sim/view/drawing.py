"""Bodies and ground as objects of viser's scene. Whatever is fixed to a body hangs below its node and moves with it."""

import math
import re
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..effects.actuators import Actuator
from ..kernels.arrays import Floats
from ..scene.solid import BOX, CYLINDER
from ..values import rotation
from .look import Look
from .moment import Moment

# After Okabe and Ito's, which colour-blind people tell apart; darker, because the page's light is strong.
BODIES = ((0, 90, 150), (190, 70, 0), (0, 110, 80), (160, 70, 120), (150, 110, 0), (40, 130, 180))
FORCE, TORQUE, ACTUATOR, TETHER = (240, 130, 0), (200, 30, 140), (0, 120, 60), (70, 70, 70)
SWITCHES = ("frames", "wrench", "actuators", "trail", "ground")
TRAIL = 600  # points
TRAIL_EVERY = 5  # pictures
_UNSEEN = 1e-3  # share of the body's extent below which an arrow is not drawn


class Arrow:
    """An arrow below a node, not seen until it points somewhere. ``most`` is for whoever scales it."""

    def __init__(self, scene: Any, name: str, color: Sequence[int], extent: float):
        self._arrow = scene.add_arrows(
            name,
            np.zeros((1, 2, 3)),
            np.array(color, np.uint8),
            shaft_radius=0.02 * extent,
            head_radius=0.05 * extent,
            head_length=0.12 * extent,
            visible=False,
        )
        self._least, self._long, self._shown = _UNSEEN * extent, False, True
        self.most = 0.0

    def point(self, begin: Sequence[float], vector: Sequence[float]) -> None:
        """From a point [m] along a vector [m]."""
        long = math.hypot(*vector) > self._least
        if long:
            self._arrow.points = np.array([[begin, np.add(begin, vector)]], np.float32)
        if long != self._long:
            self._long = long
            self._arrow.visible = long and self._shown

    def switch(self, shown: bool) -> None:
        """Show or hide it."""
        self._shown = shown
        self._arrow.visible = shown and self._long


class DrawnBody:
    """One body in the scene of a server of viser."""

    def __init__(self, scene: Any, name: str, look: Look, number: int):
        self._scene, self._look, self.name = scene, look, name
        self._root, self._color = f"/{_node(name)}", BODIES[number % len(BODIES)]
        self._node = scene.add_frame(self._root, show_axes=False)
        self._parts: dict[str, list[Any]] = {what: [] for what in SWITCHES}
        self._add_solid()
        self._add_frames()
        self._add_actuators()
        self._label = scene.add_label(
            f"{self._root}/label", name, position=(0.0, 0.0, 1.2 * look.extent), anchor="bottom-center", visible=False
        )
        self._force = Arrow(scene, f"{self._root}/force", FORCE, look.extent)
        self._torque = Arrow(scene, f"{self._root}/torque", TORQUE, look.extent)
        self._levels = [
            Arrow(scene, f"{self._root}/level/{_node(one.name)}", ACTUATOR, look.extent) for one in look.actuators
        ]
        self._tether = self._lines("tethers", TETHER, np.zeros((max(1, len(look.tethers)), 2, 3)), 0.01)
        self._trail = self._lines("trail", self._color, np.zeros((1, 2, 3)), 0.012)
        self._places: deque[tuple[float, ...]] = deque(maxlen=TRAIL)
        self._pictures, self._time = 0, -np.inf
        self._trail_shown = True
        self._moment: Moment | None = None
        self.place: tuple[float, ...] = ()

    def _add_solid(self) -> None:
        shown, name = self._look.solid, f"{self._root}/solid"
        see_through = 0.3 if self._look.actuators and self._look.mesh is None else None
        where = {
            "opacity": see_through,
            "position": np.asarray(shown.point, float),
            "wxyz": np.asarray(shown.q_body_solid, float),
        }
        size = np.asarray(shown.size, float)
        if self._look.mesh is not None:
            vertices, triangles = self._look.mesh
            self._scene.add_mesh_simple(
                name, vertices * size, triangles, color=self._color, flat_shading=True, side="double", **where
            )
        elif shown.kind == BOX:
            self._scene.add_box(name, color=self._color, dimensions=size, **where)
        elif shown.kind == CYLINDER:
            self._scene.add_cylinder(name, 0.5 * size[0], size[2], color=self._color, **where)
        else:
            self._scene.add_icosphere(name, 0.5, self._color, subdivisions=4, scale=tuple(size.tolist()), **where)

    def _add_frames(self) -> None:
        length = 1.5 * self._look.extent
        places = {"": ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), **self._look.frames}
        for name, (position, orientation) in places.items():
            size = length if not name else 0.4 * length
            part = self._scene.add_frame(
                f"{self._root}/frames/{_node(name) or 'body'}",
                axes_length=size,
                axes_radius=0.018 * size,
                position=position,
                wxyz=orientation,
            )
            self._parts["frames"].append(part)

    def _add_actuators(self) -> None:
        places = [one.position for one in self._look.actuators if one.type != "wheel"]
        for one in self._look.actuators:
            self._parts["actuators"].append(self._add_actuator(one))
        if places:  # arms, from the origin to each
            arms = np.array([[(0.0, 0.0, 0.0), place] for place in places], np.float32)
            thickness = 0.06 * self._look.extent
            self._scene.add_line_segments(
                f"{self._root}/arms", arms, np.array(self._color, np.uint8), thickness=thickness
            )

    def _add_actuator(self, one: Actuator) -> Any:
        """A disc across the axis; a thruster's is small and long."""
        size = self._look.extent
        radius, height = (0.08 * size, 0.2 * size) if one.type == "thruster" else (0.3 * size, 0.03 * size)
        return self._scene.add_cylinder(
            f"{self._root}/actuators/{_node(one.name)}",
            radius,
            height,
            color=ACTUATOR,
            position=one.position,
            wxyz=_turn_from_z(one.axis),
        )

    def _lines(self, name: str, color: Sequence[int], points: Floats, thickness: float) -> Any:
        return self._scene.add_line_segments(
            f"/{name}/{_node(self.name)}",
            points,
            np.array(color, np.uint8),
            thickness=thickness * self._look.extent,
            visible=False,
        )

    def label(self, shown: bool) -> None:
        """Show or hide the body's name."""
        self._label.visible = shown

    def switch(self, what: str, shown: bool) -> None:
        """Show or hide a kind of part, one of SWITCHES."""
        for part in self._parts[what]:
            part.visible = shown
        for arrow in {"wrench": [self._force, self._torque], "actuators": self._levels}.get(what, []):
            arrow.switch(shown)
        if what == "trail":
            self._trail_shown = shown
            self._trail.visible = shown and len(self._places) > 1

    def show(self, moment: Moment) -> None:
        """Put the body where it is at a moment."""
        if moment is self._moment:
            return
        before, self._moment = self._moment, moment
        self.place = tuple(moment.position)
        self._node.position, self._node.wxyz = self.place, tuple(moment.orientation)
        if before is None or moment[3:] != before[3:]:
            self._show_wrench(moment)
            self._show_levels(moment)
        self._show_tethers(moment)
        self._show_trail(moment.time)

    def _show_wrench(self, moment: Moment) -> None:
        """Arrows as long as the force and the torque are beside the largest seen so far."""
        for arrow, vector in ((self._force, moment.force), (self._torque, moment.torque)):
            arrow.most = max(arrow.most, math.hypot(*vector))
            length = 2.0 * self._look.extent / arrow.most if arrow.most > 0.0 else 0.0
            arrow.point((0.0, 0.0, 0.0), [length * part for part in vector])

    def _show_levels(self, moment: Moment) -> None:
        for arrow, one, share in zip(self._levels, self._look.actuators, moment.levels, strict=False):
            length = self._look.extent * share / math.hypot(*one.axis)
            arrow.point(tuple(one.position), [length * part for part in one.axis])

    def _show_tethers(self, moment: Moment) -> None:
        if self._look.tethers:
            place = np.array(moment.position)
            ends = [rotation.rotate(moment.orientation, one.body_point) + place for one in self._look.tethers]
            anchors = [one.anchor for one in self._look.tethers]
            self._tether.points = np.stack([np.array(ends), np.array(anchors)], axis=1).astype(np.float32)
            self._tether.visible = True

    def _show_trail(self, time: float) -> None:
        """Of the places since time last went back, each some pictures after the one before."""
        if time < self._time:
            self._places.clear()
        if time != self._time and self._pictures % TRAIL_EVERY == 0:
            self._places.append(self.place)
            if len(self._places) > 1:
                places = np.array(self._places, np.float32)
                self._trail.points = np.stack([places[:-1], places[1:]], axis=1)
            self._trail.visible = len(self._places) > 1 and self._trail_shown
        self._pictures, self._time = self._pictures + 1, time


class DrawnGround:
    """The ground as a plane with lines every metre, and the world's axes; without a ground the axes alone."""

    def __init__(self, scene: Any):
        self._scene, self._plane, self._shown = scene, None, True

    def add(self, look: Look) -> None:
        """What stands below one more body: the first ground is drawn, and the world's axes as large as that body."""
        self._scene.add_frame("/world", axes_length=look.extent, axes_radius=0.01 * look.extent)
        if look.ground is not None and self._plane is None:
            normal = look.ground.unit_normal
            self._plane = self._scene.add_grid(
                "/ground",
                infinite_grid=True,
                cell_size=0.25,
                section_size=1.0,
                fade_distance=40.0 * look.extent,
                plane_color=(205, 200, 190),
                plane_opacity=0.5,
                position=normal * look.ground.height,
                wxyz=_turn_from_z(normal),
                visible=self._shown,
            )

    def switch(self, shown: bool) -> None:
        """Show or hide the plane."""
        self._shown = shown
        if self._plane is not None:
            self._plane.visible = shown


def _node(name: str) -> str:
    """A name as one part of the name of a node of viser's, whose parts are apart by slashes."""
    return re.sub(r"\W", "_", name.strip("/"))


def _turn_from_z(axis: Sequence[float] | Floats) -> Floats:
    """The quaternion that turns z onto an axis."""
    to = np.asarray(axis, float) / np.linalg.norm(axis)
    if to[2] < -1.0 + 1e-12:
        return np.array((0.0, 1.0, 0.0, 0.0))
    return rotation.normalize((1.0 + to[2], -to[1], to[0], 0.0))
