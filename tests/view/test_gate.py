"""Who may open the page."""

from collections.abc import Sequence

import pytest
from hypothesis import given, strategies as st

from dreamdrive.view.gate import Gate

HERE = "localhost:8080"


def headers(**values: str | Sequence[str]):
    """Header names with dashes for underscores."""
    found = {
        name.replace("_", "-"): [each] if isinstance(each, str) else list(each)
        for name, each in values.items()
    }
    return lambda name: found.get(name, [])


@pytest.mark.parametrize("host", [HERE, "127.0.0.1:8080", "[::1]:8080", "LOCALHOST", "localhost:9000"])
def test_on_this_machine_its_own_names_open_it(host: str) -> None:
    gate = Gate.of("localhost", 8080)
    assert gate.token is None
    assert gate.refusal("/", headers(Host=host)) is None
    assert gate.refusal("/", headers(Host=host, Origin=f"http://{host}")) is None
    assert gate.cookie("/") is None


@pytest.mark.parametrize(
    "host", ["evil.example:8080", "localhost.evil.example", "127.0.0.1.evil.example", "", "10.0.0.1"]
)
def test_a_name_of_others_that_leads_here_does_not(host: str) -> None:
    assert (
        Gate.of("127.0.0.1", 8080).refusal("/", headers(Host=host)) == "this page is open at localhost alone"
    )


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://localhost:9999", "https://localhost", ""]
)
def test_another_page_does_not(origin: str) -> None:
    for gate in (Gate(8080), Gate(8080, "secret")):
        assert gate.refusal("/?token=secret", headers(Host=HERE, Origin=origin)) == "another page asks"


@pytest.mark.parametrize("hosts", [[], [HERE, HERE], [HERE, "evil.example"]])
def test_a_request_names_one_host(hosts: list[str]) -> None:
    assert Gate(8080).refusal("/", headers(Host=hosts)) == "a request names one host"


def test_from_elsewhere_the_token_opens_it_and_then_the_cookie() -> None:
    gate = Gate.of("0.0.0.0", 8080)
    assert gate.token is not None
    assert len(gate.token) >= 32
    assert gate.token != Gate.of("0.0.0.0", 8080).token
    address = gate.address("car.example")
    assert address.startswith("http://car.example:8080/?token=")
    path, asks = address.removeprefix("http://car.example:8080"), headers(Host="car.example:8080")
    assert gate.refusal(path, asks) is None
    cookie = gate.cookie(path)
    assert cookie is not None
    assert "HttpOnly" in cookie
    assert "SameSite" in cookie
    kept = cookie.partition(";")[0]
    assert gate.refusal("/", headers(Host="car.example:8080", Cookie=f"a=b; {kept}")) is None
    assert gate.refusal("/", headers(Host="car.example:8080", Cookie=["a=b", kept])) is None
    assert gate.cookie("/") is None


@given(st.text(max_size=60))
def test_nothing_else_opens_it(told: str) -> None:
    gate = Gate(8080, "secret")
    asks = headers(Host="car.example", Cookie=f"dreamdrive-view-8080={told}; {told}")
    if told != "secret":
        assert gate.refusal(f"/?{told}", headers(Host="car.example")) is not None
        assert gate.refusal(f"/?token={told}&x", headers(Host="car.example")) is not None or "secret" in told
        assert gate.refusal("/", asks) is not None or "secret" in told


def test_an_address_of_version_six_is_bracketed() -> None:
    assert Gate(8080).address("::1") == "http://[::1]:8080/"
