"""Entry point of rigid_body_demo: node and pointing controller as two processes, watched over their topics."""

import argparse
import contextlib
import math
import os
import random
import re
import sys
import time
import webbrowser
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import first_start
from ..command_line import GET_ROS, INTERRUPTED, Parser
from ..scene.installed import installed_scene
from ..scene.loader import Scene, load_scene
from ..scene.schema import PARTS
from ..values import rotation
from . import demo_plot, findings
from .processes import Child, ChildError, Children, children

if TYPE_CHECKING:
    from rclpy.executors import Executor

    from .listener import Listener

Show = Callable[["Listener"], None]  # shows how far it is

TARGET = (1.0, 0.0, 0.0, 0.0)  # body axes along the world's
MAX_TORQUE = 0.05  # N m
CONNECTED_WITHIN = 120.0  # s: kernels may have to be compiled on a slow machine
NEXT_POSE_WITHIN = 10.0  # s
PAGE_WITHIN = 60.0  # s
HOW_TO_INSTALL = "pip install matplotlib tqdm"


def main(args: list[str] | None = None) -> int:
    """Run the demo. Returns the exit status: 0, 1 when something failed, 130 after Ctrl-C."""
    arguments = _parser().parse_args(args)
    try:
        with _no_traceback():
            if not arguments.out.absolute().parent.is_dir():
                raise ValueError(f"--out {arguments.out}: there is no such folder")
            scene = load_scene(arguments.scene)
            _private_domain()
            with children() as running:
                viewer = _start_viewer(running) if arguments.view else None
                heard = _watch(running, arguments.scene, scene, arguments.duration)
                if viewer is None:
                    running.end()
                _report(scene, heard, arguments)
                if viewer is not None:
                    _go_on(running)
    except _DemoError as ended:
        print(f"rigid_body_demo: {ended}", file=sys.stderr)
        return ended.status
    return 0


class _DemoError(Exception):
    def __init__(self, text: object, status: int = 1):
        super().__init__(text)
        self.status = status


@contextlib.contextmanager
def _no_traceback() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        raise _DemoError("interrupted", INTERRUPTED) from None
    except (OSError, ValueError, ChildError, TimeoutError) as reason:
        raise _DemoError(reason) from None
    except ImportError as reason:
        raise _DemoError(f"{reason}; the demo needs rclpy: {GET_ROS}") from None


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        "rigid_body_demo",
        "Starts rigid_body_node and pointing_controller as two processes, watches them over their topics, "
        "checks energy and momentum, and draws a picture.",
    )
    parser.add_argument(
        "--duration", type=_seconds, default=20.0, metavar="S", help="simulated seconds to watch (default 20)"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("rigid_body_demo.png"), help="the picture (default %(default)s)"
    )
    parser.add_argument(
        "--view", action="store_true", help="show it in the browser meanwhile, and go on after that until Ctrl-C"
    )
    parser.add_argument("--scene", type=Path, default=None, help="parameter file of the node (default: satellite.yaml)")
    parser.set_defaults(scene=installed_scene("satellite"))
    return parser


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 1.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is not a finite number of seconds of at least 1")
    return value


# Watching -------------------------------------------------------------------------------------------------------------


def _watch(running: Children, scene_path: Path, scene: Scene, duration: float) -> "Listener":
    """Run node and controller for ``duration`` simulated seconds and return what was heard; both go on after that."""
    import rclpy

    from ..ros.executor import executor_for
    from .listener import Listener

    # Signals stay with Python here: they end the children first.
    rclpy.init(args=[], signal_handler_options=rclpy.SignalHandlerOptions.NO)
    try:
        listener = Listener(scene)
        executor = executor_for(listener)
        # The body waits until all three hear one another: nothing shall act on it unrecorded.
        _start_node(running, scene_path, scene)
        _start_controller(running, scene)
        for _ in _listening(executor, listener, running, CONNECTED_WITHIN):
            if listener.let_go():
                break
        with _progress(duration) as show:
            for _ in _listening(executor, listener, running, NEXT_POSE_WITHIN):
                if listener.orientations:
                    show(listener)
                if listener.seconds >= duration:
                    break
    finally:
        rclpy.try_shutdown()
    return listener


def _start_viewer(running: Children) -> Child:
    """The page, told and opened where there is a screen."""
    viewer, deadline = running.start("rigid_body_sim.tools.view", ["--port", "0"]), time.monotonic() + PAGE_WITHIN
    while not (url := re.search(r"http://\S+", viewer.said())):
        running.check()
        if time.monotonic() > deadline:
            raise TimeoutError(f"rigid_body_view has no page after {PAGE_WITHIN:g} s")
        time.sleep(0.05)
    print(f"The view: {url[0]}", flush=True)
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(url[0])
    return viewer


def _go_on(running: Children) -> None:
    """Until Ctrl-C, which is how it ends."""
    print("Node, controller and view go on; Ctrl-C ends them.", flush=True)
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            running.check()
            time.sleep(0.2)


def _private_domain() -> None:
    """Keep others' traffic out and ours in, unless the user chose a domain. Linux has room for domains 0 to 101."""
    if "ROS_DOMAIN_ID" not in os.environ:
        os.environ["ROS_DOMAIN_ID"] = str(random.randint(1, 100))
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"


def _start_node(running: Children, scene_path: Path, scene: Scene) -> None:
    if first_start.missing(first_start.needed(scene.terms())):
        print("The kernels are compiled first, which takes some seconds and happens once.", flush=True)
    running.start(
        "rigid_body_sim.ros.main", ["--ros-args", "--params-file", str(scene_path), "-p", "start_paused:=true"]
    )


def _start_controller(running: Children, scene: Scene) -> None:
    parameters = {
        **{f"target.orientation.{part}": value for part, value in zip(PARTS, TARGET, strict=True)},
        "inertia": list(scene["body.inertia"]),
        "max_torque": MAX_TORQUE,
        "frame_id": scene["body.frame_id"],
    }
    settings = [part for name, value in parameters.items() for part in ("-p", f"{name}:={value}")]
    # One quaternion product a pose needs no compiler, and without one the controller is there half a second earlier.
    running.start(
        "rigid_body_sim.tools.pointing_controller", ["--ros-args", *settings], {"RIGID_BODY_SIM_NO_NUMBA": "1"}
    )


def _listening(executor: "Executor", listener: "Listener", running: Children, within: float) -> Iterator[None]:
    """Serve the listener for ever. Raises ChildError, and TimeoutError when no pose comes for ``within`` seconds."""
    poses, deadline = 0, time.monotonic() + within
    while time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.05)
        running.check()
        if len(listener.orientations) > poses:
            poses, deadline = len(listener.orientations), time.monotonic() + within
        yield
    raise TimeoutError(f"no pose was heard for {within:g} s, though node and controller run")


@contextlib.contextmanager
def _progress(duration: float) -> Iterator[Show]:
    """A function that shows how far the listener is: a bar on a terminal, nothing elsewhere; lines without tqdm."""
    try:
        from tqdm import tqdm
    except ImportError:
        print(f"(A progress bar needs tqdm: {HOW_TO_INSTALL})")
        yield _every(1.0, lambda listener: print(f"{listener.seconds:5.1f} s  {_pointing(listener)}", flush=True))
        return
    with tqdm(total=duration, disable=None, bar_format="{l_bar}{bar}| {n:.1f}/{total:g} s{postfix}") as bar:

        def show(listener: "Listener") -> None:
            bar.set_postfix_str(_pointing(listener), refresh=False)
            bar.update(min(listener.seconds, duration) - bar.n)

        yield _every(0.1, show)


def _every(period: float, show: Show) -> Show:
    """``show``, called at most once in ``period`` seconds."""
    due = 0.0

    def sometimes(listener: "Listener") -> None:
        nonlocal due
        if time.monotonic() >= due:
            due = time.monotonic() + period
            show(listener)

    return sometimes


def _pointing(listener: "Listener") -> str:
    return f"pointing error {math.degrees(rotation.angle_between(TARGET, listener.latest())):.3g} deg"


# Reporting ------------------------------------------------------------------------------------------------------------


def _report(scene: Scene, listener: "Listener", arguments: argparse.Namespace) -> None:
    heard = listener.heard()
    rows = findings.table(heard, scene, TARGET, listener.diagnostics)
    width = max(map(len, rows))
    print("\n".join(f"{name:{width}}  {text}" for name, text in rows.items()))
    first, last = np.degrees(heard.error(TARGET)[[0, -1]])
    name = arguments.scene.stem.replace("_", " ")
    title = f"{name}, turned from {first:.0f}° to {last:.1g}° off its target by a controller that knows only ROS topics"
    try:
        demo_plot.draw(heard, TARGET, MAX_TORQUE, title, arguments.out)
    except ImportError:
        print(f"{'picture':{width}}  none: it needs matplotlib ({HOW_TO_INSTALL})")
    else:
        print(f"{'picture':{width}}  {arguments.out.resolve()}")


if __name__ == "__main__":
    sys.exit(main())
