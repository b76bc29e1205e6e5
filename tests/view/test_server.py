"""The server, as browsers and others ask it."""

from collections.abc import Iterator
from http.client import HTTPConnection

import pytest
import viser
import websockets
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from dreamdrive.errors import InputError
from dreamdrive.view.server import PageServer, listen, serve


@pytest.fixture(params=["localhost", "0.0.0.0"])
def served(request: pytest.FixtureRequest) -> Iterator[tuple[PageServer, int, str]]:
    listening = listen(request.param, 0)
    server, address = serve(request.param, listening)
    yield server, server.get_port(), address.partition("/?")[2]
    server.stop()


def get(port: int, path: str, **headers: str) -> tuple[int, str | None]:
    connection = HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    answer.read()
    connection.close()
    return answer.status, answer.headers["Set-Cookie"]


def test_the_page_and_its_connection_open_to_whom_they_should(served: tuple[PageServer, int, str]) -> None:
    _, port, token = served
    here, sub = f"127.0.0.1:{port}", [websockets.Subprotocol(f"viser-v{viser.__version__}")]
    status, cookie = get(port, f"/?{token}")
    assert status == 200
    assert (cookie is not None) == bool(token)
    passport = {} if cookie is None else {"Cookie": cookie.partition(";")[0]}
    assert get(port, "/", **passport) == (200, None)
    with connect(f"ws://{here}", subprotocols=sub, origin=websockets.Origin(f"http://{here}"),
                 additional_headers=passport) as socket_:  # fmt: skip
        assert socket_.recv(timeout=10)
    refused: list[dict[str, str]] = [{"Origin": "http://evil.example", **passport}]
    refused += [{}] if token else [{"Host": f"evil.example:{port}"}]
    for headers in refused:
        assert get(port, "/", **headers)[0] == 403
        with (
            pytest.raises(InvalidStatus, match="403"),
            connect(f"ws://{here}", subprotocols=sub, additional_headers=headers),
        ):
            pass
    assert websockets.asyncio.server.serve.__module__ == "websockets.asyncio.server"


def test_it_is_never_shared(served: tuple[PageServer, int, str]) -> None:
    assert served[0].request_share_url() is None


def test_a_port_that_is_taken_is_said_with_one_that_is_free() -> None:
    with listen("localhost", 0) as taken:
        port = taken.getsockname()[1]
        assert taken.getsockname()[0] == "127.0.0.1"
        with pytest.raises(InputError, match=rf"port {port} of localhost is taken.*--port \d+") as said:
            listen("localhost", port)
        listen("localhost", int(str(said.value).rpartition(" ")[2])).close()


@pytest.mark.parametrize("host", ["203.0.113.9", "no such host"])
def test_a_host_that_is_not_this_machine_is_refused(host: str) -> None:
    with pytest.raises(InputError, match="expected an address of this machine"):
        listen(host, 0)


def test_a_viser_that_serves_in_another_way_opens_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viser.ViserServer, "__init__", lambda self, **_: None)
    with listen("localhost", 0) as unused, pytest.raises(RuntimeError, match="open to all"):
        serve("localhost", unused)
