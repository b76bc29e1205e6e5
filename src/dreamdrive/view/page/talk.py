"""What the page tells and asks."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from viser import ClientHandle

from dreamdrive.errors import InputError

_GOOD_S, _BAD_S = 6.0, 15.0


@dataclass
class Talk:
    """Notes and questions in one browser, and one thing at a time done for it."""

    client: ClientHandle
    lock: threading.RLock = field(default_factory=threading.RLock)

    def say(self, title: str, body: str = "") -> None:
        """Tell of what was done."""
        self.client.add_notification(title, body, auto_close_seconds=_GOOD_S)

    def refuse(self, body: str) -> None:
        """Tell of what cannot be done."""
        self.client.add_notification("That cannot be done", body, color="red", auto_close_seconds=_BAD_S)

    def doing(self, act: Callable[[], None]) -> Callable[[Any], None]:
        """A callback that does something alone, by a user's hand alone, and tells where it cannot be done."""

        def called(event: Any) -> None:
            if event.client is None:  # the page itself has set the value
                return
            self.alone(act)

        return called

    def alone(self, act: Callable[[], None]) -> None:
        """Do something while nothing else is done for this browser, and tell where it cannot be done."""
        try:
            with self.lock:
                act()
        except InputError as error:
            self.refuse(str(error))

    def unlocked(self, act: Callable[[], None]) -> Callable[[Any], None]:
        """The same of something long, beside which the page goes on."""

        def called(event: Any) -> None:
            try:
                act()
            except InputError as error:
                self.refuse(str(error))

        return called

    def ask(self, question: str, yes: str, act: Callable[[], None]) -> None:
        """Do something, on another thread, if the user says so."""
        window = self.client.gui.add_modal("Replace it?")
        with window:
            self.client.gui.add_markdown(question)
            agree = self.client.gui.add_button(yes, color="red")
            keep = self.client.gui.add_button("Keep it")

        def agreed(_: Any) -> None:
            window.close()
            try:
                act()
            except InputError as error:
                self.refuse(str(error))

        agree.on_click(agreed)
        keep.on_click(lambda _: window.close())
