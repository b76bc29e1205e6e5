"""Every command that writes, deletes or replaces, held to one property.

Whatever happens to it, and whatever lies at its place: nothing else changes, no half result stands under a
final name, and nothing is left behind but what the next run removes.
"""

import os
import re
import signal
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import takewhile, zip_longest
from pathlib import Path

import pytest

from dreamdrive.files.output import MARK, remove
from tests.cli.test_commands_document import Help, commands, help_of
from tests.files.test_output import tree
from tests.output.conftest import Server
from tests.output.server import Call, Came
from tests.output.writers import FURTHER_MOMENTS, WRITERS, Writer

__all__ = ["help_of"]
Tree = dict[str, bytes | str | None]
_PRIVATE = ".dreamdrive-"
_LOCK = ".dreamdrive.lock"
ELSEWHERE = {("evaluate perception", "json"), ("view", "output")}
"""A second place that a command writes to, by what the others write JSON with; and what the page writes when
somebody asks for it, by what render, plan and edit write with (``tests/view/test_saving.py``)."""
_ENDS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


@dataclass(frozen=True)
class Desk:
    """A folder of a user, with letters, in which one command writes to one place."""

    server: Server
    inputs: Path
    folder: Path
    writer: Writer

    @property
    def moments(self) -> int:
        """At how many moments it is stopped."""
        first = next(each for each in WRITERS.values() if name_of(each) == name_of(self.writer))
        return self.writer.moments if self.writer is first else FURTHER_MOMENTS

    @property
    def place(self) -> Path:
        return self.folder / "out" / f"result{self.writer.ending}"

    def call(self, writer: Writer | None = None, **how: object) -> Call:
        words = [
            word.replace("IN/", f"{self.inputs}/").replace("OUT", str(self.place))
            for word in (writer or self.writer).words
        ]
        environment = {"TMPDIR": str(self.folder / "tmp"), "HOME": str(self.folder)}
        return Call(words, str(self.folder / "work"), environment=environment, **how)  # type: ignore[arg-type]

    def run(self, writer: Writer | None = None, **how: object) -> Came:
        came = self.server(self.call(writer, **how))
        assert "Traceback" not in came.said, came.said
        assert not came.children_left
        return came

    def others(self) -> Tree:
        """All but the result and what writers keep beside it."""
        mine = self.place.relative_to(self.folder).as_posix()
        return {
            name: content
            for name, content in tree(self.folder).items()
            if not (name == mine or name.startswith((f"{mine}/", "tmp"))) and _PRIVATE not in name
        }

    def result(self) -> Tree | None:
        """What stands under the final name; files that differ from run to run by their names alone."""
        if not self.place.exists():
            return None
        if self.place.is_file():
            return {"": self.place.read_bytes()}
        loose = (*self.writer.loose, "losses.jsonl", "checkpoint.json")
        return {
            name: None if {name.split("/")[0], name.split("/")[-1]} & {*loose} else content
            for name, content in tree(self.place).items()
            if not name.startswith("stages/") and _PRIVATE not in name and name != _LOCK
        }

    def left(self) -> list[str]:
        """What writers left beside the result, and in the folder for temporary files."""
        found = [p.relative_to(self.folder).as_posix() for p in self.folder.rglob("*")]
        return [name for name in found if _PRIVATE in name or name.startswith("tmp/") or _LOCK in name]


def name_of(writer: Writer) -> str:
    """The command alone, as ``evaluate video``."""
    return " ".join(takewhile(str.isalpha, writer.words))


@pytest.fixture
def desk(request: pytest.FixtureRequest, server: Server, inputs: Path, tmp_path: Path) -> Desk:
    (tmp_path / "desk" / "out").mkdir(parents=True)
    (tmp_path / "desk" / "work").mkdir()
    (tmp_path / "desk" / "tmp").mkdir()
    for name in ("out/letter.txt", "work/manifest.json", "layout.json"):
        (tmp_path / "desk" / name).write_text("Dear reader")
    return Desk(server, inputs, tmp_path / "desk", WRITERS[request.param])


def of_others(name: str, text: str = "theirs") -> Callable[[Desk], None]:
    """A folder of others, which holds a file that one of ours might hold."""

    def put(desk: Desk) -> None:
        (desk.place / name).parent.mkdir(parents=True)
        (desk.place / name).write_text(text)

    return put


def pipe(desk: Desk) -> None:
    os.mkfifo(desk.place)


def leads_nowhere(desk: Desk) -> None:
    desk.place.symlink_to("gone/away")


def leads_to_itself(desk: Desk) -> None:
    desk.place.symlink_to(desk.place.name)


def leads_to_a_folder_of_others(desk: Desk) -> None:
    desk.place.symlink_to("../work")


def letter(desk: Desk) -> None:
    desk.place.write_text("Dear reader")


MARKED = '{"dreamdrive": "scene", "files": ["a.txt"], "identity": 1}'
FOREIGN = (
    *(
        of_others(name)
        for name in ("letter.txt", "manifest.json", "layout.json", "static.ply", "render.json")
    ),
    *(of_others(name) for name in ("v1.0-mini/scene.json", "scene/scene.json", "report.json", "pairs/a.npy")),
    *(of_others(name) for name in ("checkpoint-1.safetensors", "street.safetensors", "stages/request.json")),
    *(of_others(MARK, text) for text in ("", "{}", "[]", MARKED)),
    *(pipe, leads_nowhere, leads_to_itself, leads_to_a_folder_of_others),
)
every_writer = pytest.mark.parametrize("desk", WRITERS, indirect=True)


def test_every_command_that_writes_is_here(help_of: Help) -> None:
    """An option that names a place to write, or a command that deletes, is in the table or below."""
    writes = re.compile(r"--(out|output|json|picture)\b")
    found = {
        (command, option)
        for command in commands(help_of)
        for option in writes.findall(help_of(*command.split()))
    }
    listed = {(each, option) for each, option in ELSEWHERE}
    for writer in WRITERS.values():
        words = writer.command.split()
        flag = words[words.index("OUT") - 1]
        names = ("out", "output") if flag == "-o" else (flag.removeprefix("--"),)
        listed |= {(" ".join(words[:count]), name) for count in (1, 2) for name in names}
    assert found <= listed, f"not held to the property: {found - listed}"


@pytest.mark.slow
@every_writer
def test_a_result_is_written_alone(desk: Desk) -> None:
    before = desk.others()
    came = desk.run()
    assert came.code == 0, came.said
    assert desk.result()
    assert desk.others() == before
    assert not desk.left()


@pytest.mark.slow
@every_writer
@pytest.mark.parametrize("forced", [True, False])
def test_what_is_not_ours_is_not_replaced(desk: Desk, forced: bool) -> None:
    """Folders of others with files of known names, files, pipes, and links that lead nowhere."""
    writer = desk.writer if forced else replace(desk.writer, force=())
    for put in FOREIGN:
        put(desk)
        before = tree(desk.folder)
        came = desk.run(writer)
        after = tree(desk.folder)
        if came.code or not writer.goes_on:
            assert came.code == 2, (put, came.said)
            assert came.said.count("error: ") == 1, came.said
        else:  # what goes on in a folder may write beside what is there
            after = {name: content for name, content in after.items() if name in before}
        assert after == before, (put, came.said)
        assert not desk.left()
        remove(desk.place)


@pytest.mark.slow
@every_writer
def test_a_link_is_followed_and_stays(desk: Desk) -> None:
    aim = desk.folder / "another disk" / f"real{desk.writer.ending}"
    aim.parent.mkdir()
    desk.place.symlink_to(aim)
    before = desk.others()
    came = desk.run()
    assert came.code == 0, came.said
    assert desk.place.is_symlink()
    assert aim.exists()
    after = {k: v for k, v in desk.others().items() if not k.startswith(f"another disk/{aim.name}")}
    assert after == before
    assert not desk.left()


@pytest.mark.slow
@every_writer
def test_a_full_disk_is_said_and_nothing_half_stays(desk: Desk) -> None:
    """Files end at each of some sizes, below what the command writes."""
    came = desk.run()
    whole, before = desk.result(), desk.others()
    largest = max(p.stat().st_size for p in (desk.place, *desk.place.rglob("*")) if p.is_file())
    remove(desk.place)
    for share in (0.0, 0.1, 0.5, 0.95):
        came = desk.run(most_bytes=int(share * largest))
        assert came.code == 2, came.said
        assert re.search("error: .*(disk|space|cannot|write)", came.said), came.said
        assert desk.others() == before
        assert half(desk, whole) is None
        assert not desk.left()
        if not desk.writer.goes_on:
            assert not desk.place.exists()
    came = desk.run()
    assert came.code == 0, came.said
    assert desk.result() == whole


@pytest.mark.slow
@every_writer
def test_two_at_once_do_each_other_no_harm(desk: Desk) -> None:
    """The first stands still at each of some moments while the second runs."""
    came = desk.run()
    whole, before = desk.result(), desk.others()
    for at in moments(came.changes, max(4, desk.moments // 2)):
        remove(desk.place)
        first = desk.run(signal=signal.SIGSTOP, at=at)
        assert first.said == "stopped"
        second = desk.run(replace(desk.writer, force=()))
        first = desk.server(Call([], "", go_on=first.code))
        assert (second.code == 0) or re.search("error: .*(is in use|exists already)", second.said), (
            second.said
        )
        assert (first.code == 0) or re.search("error: .*exists already", first.said), first.said
        assert 0 in (first.code, second.code)
        assert desk.result() == whole
        assert desk.others() == before
        assert not desk.left()


@pytest.mark.slow
@every_writer
@pytest.mark.parametrize("how", ["kill", "signals"])
def test_stopped_at_any_moment_nothing_half_stays(desk: Desk, how: str) -> None:
    """Half of the moments are counted in changes of files, half in seconds."""
    came = desk.run()
    whole, before = desk.result(), desk.others()
    for number, moment in enumerate(moments_of(came, desk.moments)):
        if number % 5 == 0:  # else an older result is there, which stays or is replaced
            remove(desk.place)
        end = signal.SIGKILL if how == "kill" else _ENDS[number % 3]
        writer = desk.writer if desk.writer.force else replace(desk.writer, force=())
        came = desk.run(writer, signal=end, **moment)
        assert came.code in (0, 130, 143, -end), came
        assert desk.others() == before
        assert half(desk, whole) is None, moment
        if how == "signals":
            assert not desk.left(), (moment, came)
    for left in (desk.folder / "tmp").iterdir():
        os.utime(left, (0, 0))  # young ones are left alone: they may be about to be used
    came = desk.run()
    assert came.code == 0, came.said
    assert desk.result() == whole
    assert desk.others() == before
    assert not desk.left()


def moments(changes: int, count: int) -> list[int]:
    """So many numbers of changes, from the first to the last."""
    return sorted({round(k * (changes - 1) / (count - 1)) for k in range(count)})


def moments_of(came: Came, count: int) -> list[dict[str, float]]:
    counted: list[dict[str, float]] = [{"at": at} for at in moments(came.changes, count // 2)]
    timed = [{"after": came.seconds * (k + 0.5) / (count // 2)} for k in range(count // 2)]
    return [each for pair in zip_longest(counted, timed) for each in pair if each is not None]


def half(desk: Desk, whole: Tree | None) -> str | None:
    """What is wrong with what stands under the final name; nothing where it is absent or whole."""
    found = desk.result()
    if found is None or found == whole:
        return None
    if not desk.writer.goes_on:
        return f"neither absent nor whole: {sorted(found)}"
    assert whole is not None
    wrong = [name for name, content in found.items() if name in whole and content not in (None, whole[name])]
    return f"half done: {wrong}" if wrong else None
