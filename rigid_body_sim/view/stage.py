"""All that is on the page whatever it shows: bodies, ground, and the panel's switches."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..kernels.arrays import Floats
from . import page
from .drawing import SWITCHES, DrawnBody, DrawnGround
from .look import Look
from .moment import Moment

_FROM = (0.7, -0.6, 0.4)  # direction of the camera from what it looks at
_LAST = 1e9  # place in the panel
_STEP = 0.01  # of its distance: it follows in steps, not at each picture


class Stage:
    """A page on which bodies are shown by name. ``server`` is viser's, whose panel others add to.

    Raises ViewError as ``page.open_page`` does.
    """

    def __init__(self, title: str, host: str = page.HOST, port: int = page.PORT):
        self.server = page.open_page(title, host, port)
        self.url = page.address(self.server)
        self.looks: dict[str, Look] = {}
        self._ground = DrawnGround(self.server.scene)
        self._bodies: dict[str, DrawnBody] = {}
        self._status = self.server.gui.add_markdown("")
        self._told = ""
        self._switches: dict[str, Any] = {}
        self._distance = 0.0  # of the camera [m]
        self._follow: Any = None
        self._looked_at: tuple[float, ...] | None = None
        self.server.on_client_connect(lambda client: self.put_camera(client.camera))

    def add_switches(self) -> None:
        """The panel's last part: what is shown."""
        with self.server.gui.add_folder("Show", expand_by_default=False, order=_LAST):
            for what in SWITCHES:
                box = self._switches[what] = self.server.gui.add_checkbox(what.capitalize(), True)
                box.on_update(lambda event, what=what: self._switch(what, event.target.value))
            self._follow = self.server.gui.add_checkbox("Follow", True, hint="The camera moves along with the body.")

    def add(self, name: str, look: Look) -> None:
        """One more body."""
        self.looks[name] = look
        self._distance = max(self._distance, 5.0 * look.extent)
        self._ground.add(look)
        self._bodies[name] = DrawnBody(self.server.scene, name, look, len(self._bodies))
        for body in self._bodies.values():
            body.label(len(self._bodies) > 1)
        for what, box in self._switches.items():
            self._bodies[name].switch(what, box.value)
        if look.note:
            self.server.gui.add_markdown(look.note)

    def _switch(self, what: str, shown: bool) -> None:
        for body in self._bodies.values():
            body.switch(what, shown)
        if what == "ground":
            self._ground.switch(shown)

    def show(self, moments: Mapping[str, Moment]) -> None:
        """One picture."""
        with self.server.atomic():
            for name, moment in moments.items():
                self._bodies[name].show(moment)
        self._move_cameras()

    def _move_cameras(self) -> None:
        """Cameras begin beside what is in the middle of the bodies, and then move along with it."""
        places = [body.place for body in self._bodies.values() if body.place]
        if not places:
            return
        middle = tuple(sum(axis) / len(places) for axis in zip(*places, strict=True))
        if self._looked_at is None:
            spread = max(math.dist(place, middle) for place in places)
            self._distance += 3.0 * spread
            self._looked_at = middle
            for client in self.server.get_clients().values():
                self.put_camera(client.camera)
        moves = math.dist(middle, self._looked_at) > _STEP * self._distance
        if moves and self._follow is not None and self._follow.value:
            moved, self._looked_at = np.subtract(middle, self._looked_at), middle
            for client in self.server.get_clients().values():
                client.camera.position = client.camera.position + moved  # which takes look_at along

    def put_camera(self, camera: Any, path: Floats | None = None) -> None:
        """Where it begins: who comes later looks at where the bodies are by then; or so that a path, (n, 3), is seen.

        viser's ``initial_camera`` is for saved pages alone: a browser applies it after what is set when it connects.
        """
        middle, distance = self._looked_at, self._distance
        if path is not None:
            middle = 0.5 * (path.min(axis=0) + path.max(axis=0))
            distance += float(np.linalg.norm(np.ptp(path, axis=0)))
        if middle is not None:
            camera.position = np.array(middle) + distance * np.array(_FROM)
            camera.look_at = middle

    def tell(self, text: str) -> None:
        """Write the status, Markdown, at the top of the panel."""
        if text != self._told:
            self._told = self._status.content = text

    def close(self) -> None:
        """End the page."""
        page.close(self.server)
