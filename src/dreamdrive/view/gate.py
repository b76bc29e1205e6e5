"""Who may open the page and its connection."""

import hmac
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

LOOPBACK = ("localhost", "127.0.0.1", "::1")
"""Names of this machine that only its own users reach."""
_TOKEN = "token"

Headers = Callable[[str], Sequence[str]]
"""All values of a header, by its name."""


@dataclass(frozen=True)
class Gate:
    """What a request has to show.

    On loopback its ``Host`` is a name of loopback, so that no name of others that leads here (DNS rebinding)
    opens it. Elsewhere it shows the token: in the address first, from then on in a cookie. Where a browser
    says from which page a request comes (``Origin``), that is this one.

    Attributes:
        port: Of the server, which is part of the cookie's name: browsers send cookies to all ports.
        token: None on loopback.
    """

    port: int
    token: str | None = None

    @classmethod
    def of(cls, host: str, port: int) -> "Gate":
        """That of a server: with a new token, unless it can be reached from this machine alone."""
        return cls(port, None if host in LOOPBACK else secrets.token_urlsafe(24))

    def refusal(self, path: str, headers: Headers) -> str | None:
        """Why a request is refused; None where it may come in."""
        hosts = headers("Host")
        if len(hosts) != 1:
            return "a request names one host"
        if self.token is None and urlsplit(f"//{hosts[0]}").hostname not in LOOPBACK:
            return "this page is open at localhost alone"
        if any(urlsplit(origin).netloc != hosts[0] for origin in headers("Origin")):
            return "another page asks"
        if self.token is not None and not self._knows(path, headers):
            return "the address lacks the token that dreamdrive view printed"
        return None

    def cookie(self, path: str) -> str | None:
        """The cookie that a page opened with the token in its address leaves."""
        if self.token is None or not self._told(path):
            return None
        return f"{self._name}={self.token}; Path=/; HttpOnly; SameSite=Lax"

    def address(self, host: str) -> str:
        """What to open in a browser."""
        named = f"[{host}]" if ":" in host else host
        secret = "" if self.token is None else f"?{_TOKEN}={self.token}"
        return f"http://{named}:{self.port}/{secret}"

    @property
    def _name(self) -> str:
        return f"dreamdrive-view-{self.port}"

    def _knows(self, path: str, headers: Headers) -> bool:
        cookies: SimpleCookie = SimpleCookie()
        for line in headers("Cookie"):
            try:
                cookies.load(line)
            except CookieError:
                return self._told(path)
        kept = cookies.get(self._name)
        return self._told(path) or (kept is not None and self._is(kept.value))

    def _told(self, path: str) -> bool:
        """Whether an address holds the token."""
        try:
            return any(self._is(each) for each in parse_qs(urlsplit(path).query).get(_TOKEN, []))
        except ValueError:
            return False

    def _is(self, told: str) -> bool:
        return hmac.compare_digest(told.encode(), (self.token or "").encode())
