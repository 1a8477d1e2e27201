"""The page: a server of viser on this machine alone, with the scene in the middle and the panel beside it."""

import contextlib
import io
import logging
import socket
from collections.abc import Iterator
from typing import Any

HOST, PORT = "127.0.0.1", 8080
HOW_TO_INSTALL = "pip install viser"
RATE = 20.0  # pictures a second to the browser, whatever comes in


class ViewError(Exception):
    """A page that cannot be shown; the text is one sentence that says what would be right."""


def open_page(title: str, host: str = HOST, port: int = PORT) -> Any:
    """A server of viser (``viser.ViserServer``) that listens on ``host`` and ``port``, 0 being any that is free.

    Raises ViewError without viser, and where nothing can listen there.
    """
    try:
        import viser
    except ImportError as reason:
        raise ViewError(f"the view needs viser, which cannot be imported ({reason}); {HOW_TO_INSTALL}") from None
    _check(host, port)
    # It logs a traceback for each connection that a browser opens ahead and closes unused.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    with _quiet():
        server = viser.ViserServer(host=host, port=port, label=title, verbose=False)
    # viser can ask a server outside for a public address of the page; whoever has the page open shall not.
    server.request_share_url = _not_shared
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    return server


def address(server: Any) -> str:
    """What to type into a browser."""
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(server.get_host(), server.get_host())
    return f"http://{f'[{host}]' if ':' in host else host}:{server.get_port()}"


def close(server: Any) -> None:
    """End the server, silently."""
    with _quiet():
        server.stop()


def _not_shared(*_: object, **__: object) -> None:
    """In place of ``ViserServer.request_share_url``."""


def _check(host: str, port: int) -> None:
    """Raise ViewError where nothing can listen: viser itself takes the next port, or waits for ever."""
    try:
        [(family, kind, protocol, _, where), *_] = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        with socket.socket(family, kind, protocol) as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            tried.bind(where)
            tried.listen()
    except (OSError, OverflowError) as reason:
        told = getattr(reason, "strerror", None) or reason
        raise ViewError(
            f"nothing can listen on {host}, port {port} ({told}); give another --port (0 = any that is free) or --host"
        ) from None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """What viser prints of itself is not for our users."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
