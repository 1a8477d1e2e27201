"""Entry point of rigid_body_view: bodies on a page in the browser, of a running node or of a bag."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from ..bags.rosbags_support import BagError
from ..command_line import GET_ROS, Parser
from ..ros import command_line, middleware, program
from ..scene.schema import one_line
from ..view.page import HOST, PORT, ViewError

NAME = "rigid_body_view"
DESCRIPTION = """Shows bodies on a page in the browser: those of running nodes, or the motion in a bag with a time line.

The page is served on this machine alone unless --host says otherwise: whoever can open it can press its buttons."""
_EPILOG = """arguments of ROS, without a bag:
  --ros-args ...       as for every node, up to the end or to --: -r __ns:=/NAMESPACE shows what is below it

examples:
  rigid_body_view
  rigid_body_view --bodies red blue --port 0 --ros-args -r __ns:=/fleet
  rigid_body_view my_bag --scene config/satellite.yaml"""
_NEEDS_ROS = f"running nodes are seen by rclpy: {GET_ROS}; or give a bag"
_HIGHEST_PORT = 65535


def main(args: Sequence[str] | None = None) -> int:
    """Show until Ctrl-C or SIGTERM. Returns the exit status: 0, or 1 with one sentence where nothing can be shown.

    Ends the program (SystemExit) after --help and --version with status 0, and with 2 for arguments that are not known.
    """
    program.open_standard_streams()
    stop = program.StopRequest()  # before anything slow is imported
    own, ros = command_line.split(args)
    options = _parser().parse_args([argument for argument in own if argument != command_line.END])
    try:
        return _show_bag(options, stop) if options.bag is not None else _show_nodes(options, ros, stop)
    except (ViewError, BagError, OSError, ValueError) as reason:
        text = one_line(reason)
    except ImportError as reason:
        text = f"{one_line(reason)}; {_NEEDS_ROS}"
    print(f"{NAME}: {text}", file=sys.stderr)
    return 1


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        NAME,
        DESCRIPTION,
        epilog=_EPILOG,
        usage="%(prog)s [-h] [--version] [BAG] [--scene FILE] [--bodies NAME ...] [--host HOST] [--port N]\n"
        "                       [--ros-args ...]",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "bag", type=Path, nargs="?", metavar="BAG", help="a bag: its folder, or a lone file (default: running nodes)"
    )
    parser.add_argument(
        "--scene",
        type=Path,
        metavar="FILE",
        help="of a bag: parameter file that tells the shape (default: its journal)",
    )
    parser.add_argument(
        "--bodies", nargs="+", default=[], metavar="NAME", help="show these alone, by the namespaces of their topics"
    )
    parser.add_argument("--host", default=HOST, help="address to listen on (default %(default)s: this machine alone)")
    parser.add_argument(
        "--port",
        type=_port,
        default=PORT,
        metavar="N",
        help="port of the page (default %(default)s); 0 = any that is free",
    )
    return parser


def _port(text: str) -> int:
    if text.isdecimal() and int(text) <= _HIGHEST_PORT:
        return int(text)
    raise argparse.ArgumentTypeError(f"{text} is no port; give a whole number from 0 to {_HIGHEST_PORT}")


def _show_bag(options: argparse.Namespace, stop: program.StopRequest) -> int:
    from ..view.player import Player
    from .view_bag import shown

    recordings, looks = shown(options.bag, options.scene, tuple(options.bodies))
    player = Player(recordings, looks, options.bag.absolute().name, options.host, options.port)
    stop.defer()
    _say(player.url)
    player.run(lambda: stop.requested)
    return 0


def _show_nodes(options: argparse.Namespace, ros: Sequence[str], stop: program.StopRequest) -> int:
    import rclpy

    from ..view.stage import Stage
    from .view_node import Viewer

    if options.scene is not None:
        raise ValueError("--scene is for a bag; leave it out: running nodes say themselves what they simulate")
    stage = Stage(NAME, options.host, options.port)
    stop.defer()
    try:
        rclpy.init(args=[command_line.BEGIN, *ros], signal_handler_options=rclpy.SignalHandlerOptions.NO)
        middleware.use_profile(middleware.libraries())
        viewer = Viewer(stage, tuple(name.strip("/") for name in options.bodies))
        _say(stage.url)
        viewer.run(stop)
        viewer.destroy_node()
    finally:
        rclpy.try_shutdown()
        stage.close()
        stop.ignore_further()
    return 0


def _say(url: str) -> None:
    print(f"{NAME}: {url} (Ctrl-C ends it)", flush=True)


if __name__ == "__main__":
    sys.exit(main())
