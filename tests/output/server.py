"""Runs ``dreamdrive`` as a process of its own at the price of a fork, and stops it at a chosen moment.

A line of JSON on the standard input is a ``Call``, a line on the standard output what came of it. Moments are
counted in the changes that a process makes to files, by which they are the same in each run, or in seconds.
"""

import fcntl
import json
import os
import resource
import signal
import sys
import time
import traceback
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Any

_CHANGES = {"os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.truncate", "shutil.rmtree"}
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
_HEEDED = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM)
_MOST_SAID = 1 << 20
_STOPPED: dict[int, "Notes"] = {}
"""Where processes that are stopped say what they say."""


@dataclass(frozen=True)
class Call:
    """A command, where it works, and what happens to it.

    ``signal`` reaches it before its change ``at``, or ``after`` so many seconds. It can write ``most_bytes``
    into a file, as if the disk were full then. Or it is one that was stopped by SIGSTOP, and shall ``go_on``.
    """

    arguments: list[str]
    folder: str
    signal: int = 0
    at: int | None = None
    after: float | None = None
    most_bytes: int | None = None
    go_on: int | None = None
    environment: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Came:
    """How a command ended, what it said, and how many changes it made; a signal that ended it is negative."""

    code: int
    said: str
    changes: int
    seconds: float
    children_left: bool = False


class Notes:
    """Pipes for what a command says and counts: files could not be written where the disk is full."""

    def __init__(self) -> None:
        (self._said, self.write), (self._changes, self.counted) = os.pipe(), os.pipe()
        fcntl.fcntl(self.write, fcntl.F_SETPIPE_SZ, _MOST_SAID)

    def said(self) -> str:
        os.close(self.write)
        with open(self._said, errors="replace") as file:
            return file.read()

    def changes(self) -> int:
        os.close(self.counted)
        with open(self._changes) as file:
            return int(file.read() or 0)


def serve() -> None:
    """Answer calls until there are no more."""
    import tests.output.loaded  # noqa: F401  # all that commands import, before the first fork

    _say("ready")
    for line in sys.stdin:
        _say(json.dumps(asdict(_answer(Call(**json.loads(line))))))


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _answer(call: Call) -> Came:
    start = time.monotonic()
    if call.go_on is not None:
        os.kill(call.go_on, signal.SIGCONT)
        return _ended(call.go_on, _STOPPED.pop(call.go_on), start)
    notes = Notes()
    # A signal waits until there is a command that can heed it.
    signal.pthread_sigmask(signal.SIG_BLOCK, _HEEDED)
    child = os.fork()
    if child == 0:
        _be(call, notes)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _HEEDED)
    if call.after is not None:
        time.sleep(call.after)
        os.kill(child, call.signal)
    if call.signal == signal.SIGSTOP:
        return _stopped(child, notes, start)
    return _ended(child, notes, start)


def _stopped(child: int, notes: "Notes", start: float) -> Came:
    """Whoever is stopped waits for ``go_on``; its number stands in place of an exit code."""
    _, status = os.waitpid(child, os.WUNTRACED)
    if not os.WIFSTOPPED(status):
        return _told(status, notes, start, child)
    _STOPPED[child] = notes
    return Came(child, "stopped", 0, time.monotonic() - start)


def _ended(child: int, notes: "Notes", start: float) -> Came:
    _, status = os.waitpid(child, 0)
    return _told(status, notes, start, child)


def _told(status: int, notes: "Notes", start: float, child: int) -> Came:
    seconds = time.monotonic() - start
    return Came(os.waitstatus_to_exitcode(status), notes.said(), notes.changes(), seconds, _left(child))


def _left(group: int) -> bool:
    """Whether processes that a command started are still there, a while after its end."""
    for _ in range(500):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return False
        time.sleep(0.02)
    with suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)
    return True


def _be(call: Call, notes: "Notes") -> None:
    """Become the command; does not return."""
    code = 70
    try:
        os.setpgid(0, 0)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(notes.write, 1)
        os.dup2(notes.write, 2)
        sys.stdout, sys.stderr = (os.fdopen(number, "w", closefd=False) for number in (1, 2))
        os.chdir(call.folder)
        os.environ.update(call.environment)
        for number in _HEEDED:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
        if call.most_bytes is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (call.most_bytes, resource.RLIM_INFINITY))
        changes = _count_changes(call)
        code = _run(call.arguments)
        os.write(notes.counted, str(changes[0]).encode())
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _count_changes(call: Call) -> list[int]:
    seen, me = [0], os.getpid()

    def heed(event: str, arguments: tuple[Any, ...]) -> None:
        writes = event == "open" and isinstance(arguments[2], int) and arguments[2] & _WRITES
        if (writes or event in _CHANGES) and os.getpid() == me:
            if seen[0] == call.at:
                seen[0] += 1
                os.kill(me, call.signal)
            else:
                seen[0] += 1

    sys.addaudithook(heed)
    return seen


def _run(arguments: list[str]) -> int:
    from dreamdrive.cli.main import main

    sys.argv = ["dreamdrive", *arguments]
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _HEEDED)
    except KeyboardInterrupt:
        return 130
    try:
        main()
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    except BaseException:  # noqa: BLE001  # a test shall see it as a user does
        traceback.print_exc()
        return 1
    return 0


if __name__ == "__main__":
    serve()
