"""The server of the page: viser behind a gate, on a socket of its own."""

import errno
import socket
import warnings
from collections.abc import Callable, Generator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any

import rich
import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from dreamdrive.errors import InputError
from dreamdrive.view.gate import LOOPBACK, Gate

ANY = ("0.0.0.0", "::")
"""Hosts that stand for all of a machine's addresses."""
_REFUSED = (errno.EADDRINUSE, errno.EACCES, errno.EPERM)


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens there and nowhere else; 0 is any free port.

    Raises:
        InputError: The port is taken or forbidden, or the host is no address of this machine.
    """
    name = LOOPBACK[1] if host == "localhost" else host
    try:
        found = socket.getaddrinfo(name, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, kind, protocol, _, address = found[0]
        made = socket.socket(family, kind, protocol)
    except OSError as error:
        raise InputError(f"--host {host}: {error.strerror}; expected an address of this machine") from error
    try:
        # As every server: a port whose last connections still wind down is free.
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind(address)
        made.listen()
    except OSError as error:
        made.close()
        if error.errno not in _REFUSED:
            raise InputError(
                f"--host {host}: {error.strerror}; expected an address of this machine"
            ) from error
        why = "is taken" if error.errno == errno.EADDRINUSE else "may not be used"
        raise InputError(f"port {port} of {host} {why}; choose another, such as --port {_free()}") from error
    return made


def _free() -> int:
    """A port that is free at this moment."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK[1], 0))
        return int(probe.getsockname()[1])


class PageServer(viser.ViserServer):
    """viser's server, which cannot be asked to show itself to others by its tunnel."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Nothing is shared."""
        return None


def serve(host: str, listening: socket.socket) -> tuple[PageServer, str]:
    """Open the page on a socket, behind its gate; the server, and the address to open in a browser."""
    rich.get_console().quiet = True  # viser's own lines, which say addresses without the token
    # A browser may go away at any moment; what was on its way to it is lost.
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
    gate = Gate.of(host, int(listening.getsockname()[1]))
    with _behind(gate, listening):
        server = PageServer(host=host, port=gate.port, label="DreamDrive", verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
    return server, gate.address(socket.gethostname() if host in ANY else host)


@contextmanager
def _behind(gate: Gate, listening: socket.socket) -> Generator[None, None, None]:
    """Let the server that viser starts meanwhile take our socket, and ask the gate before it answers.

    viser has no place for either, and calls ``serve`` of websockets by its public name.
    """
    real, used = websockets.asyncio.server.serve, False

    def guarded(handler: Any, *_: Any, **how: Any) -> Any:
        nonlocal used
        used = True
        how["process_request"] = _asking(gate, how.get("process_request"))
        return real(handler, sock=listening, **how)

    websockets.asyncio.server.serve = guarded  # type: ignore[assignment]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = real
    if not used:
        raise RuntimeError(f"viser {viser.__version__} serves in another way; its page would be open to all")


def _asking(
    gate: Gate, answer: Callable[[ServerConnection, Request], Response | None] | None
) -> Callable[[ServerConnection, Request], Response | None]:
    """What answers requests, for those that the gate lets in."""

    def asked(connection: ServerConnection, request: Request) -> Response | None:
        why = gate.refusal(request.path, request.headers.get_all)
        if why is not None:
            return connection.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
        response = None if answer is None else answer(connection, request)
        if response is not None:
            response.headers["X-Frame-Options"] = "DENY"
            response.headers["Referrer-Policy"] = "no-referrer"
            cookie = gate.cookie(request.path)
            if cookie is not None:
                response.headers["Set-Cookie"] = cookie
        return response

    return asked
