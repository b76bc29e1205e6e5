"""``dreamdrive edit``: a scene with its actors removed, moved, turned, copied or painted, or with more."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from dreamdrive.cli.scene import open_scene
from dreamdrive.cli.terminal.console import plain
from dreamdrive.errors import InputError
from dreamdrive.files.given import SCENE, check_given, check_there
from dreamdrive.files.kinds import EDITED_KIND
from dreamdrive.files.output import check_free, check_place

if TYPE_CHECKING:
    from dreamdrive.edit import Edit, Edits

_NOTHING = "there is nothing to change; give --remove ID, --move ID=AHEAD,LEFT or another edit"
_PLACE = "OTHER:ID@AHEAD,LEFT or OTHER:ID@AHEAD,LEFT,SECONDS, such as runs/b:3@15,0"
_Ids = UseAppendAction[tuple[int, ...]]
_Words = UseAppendAction[tuple[str, ...]]


@dataclass(frozen=True)
class ChangeFlags:
    """What is changed, in the order in which it is made.

    Attributes:
        remove: Leave it out.
        move: So many metres ahead of and to the left of where it is, as it points; negative is behind, right.
        turn: Turned to the left where it is.
        delay: Later, or earlier where negative.
        speed: So many times as fast.
        copy: A second one, elsewhere as move has it; its id is printed.
        recolour: In one colour.
        insert: An actor of the scene in the folder OTHER, metres ahead of and to the left of the first camera
            at its first time, else when the scene begins; its id is printed.
    """

    remove: Annotated[_Ids, arg(metavar="ID", help_behavior_hint="")] = ()
    move: Annotated[_Words, arg(metavar="ID=AHEAD,LEFT", help_behavior_hint="")] = ()
    turn: Annotated[_Words, arg(metavar="ID=DEGREES", help_behavior_hint="")] = ()
    delay: Annotated[_Words, arg(metavar="ID=SECONDS", help_behavior_hint="")] = ()
    speed: Annotated[_Words, arg(metavar="ID=FACTOR", help_behavior_hint="")] = ()
    copy: Annotated[_Words, arg(metavar="ID=AHEAD,LEFT", help_behavior_hint="")] = ()
    recolour: Annotated[_Words, arg(metavar="ID=#RRGGBB", help_behavior_hint="")] = ()
    insert: Annotated[_Words, arg(metavar="OTHER:ID@PLACE", help_behavior_hint="")] = ()


def edit(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    output: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    change: OmitArgPrefixes[ChangeFlags] = ChangeFlags(),
    edits: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    undo: Annotated[int, arg(metavar="N")] = 0,
    force: bool = False,
) -> None:
    """Change what moves in a scene; the result is a scene as any other, with its edits beside it.

    Each may be given several times; they are made in the order in which they are listed here. Ids are those
    of dreamdrive actors.

    Args:
        out: The folder that generate wrote.
        output: Folder of the edited scene.
        change: What is changed.
        edits: Make those of this file first: edits.json of an edited scene.
        undo: Leave out so many of its last ones.
        force: Replace an edited scene that is there.
    """
    check_there(out, SCENE)
    check_given(edits=edits)
    told, insert = _told(change), [_of_other(word) for word in change.insert]
    if not told and not insert and edits is None and not undo:
        raise InputError(_NOTHING)
    check_place(output, out)
    check_free(output, force, EDITED_KIND)
    from dreamdrive import edit as package

    before = _before(out, edits, undo)
    new = tuple(cast("Edit", getattr(package, name)(*values)) for name, values in told)
    new += tuple(package.Insert.from_folder(*values) for values in insert)
    if not new and not before.edits:
        raise InputError(_NOTHING)
    scene = open_scene(out)
    made = package.write_edited(scene, before.and_then(new), output, replace=force)
    console = plain()
    known = {actor.id for actor in scene.actors}
    for actor in made.actors:
        if actor.id not in known:
            console.print(f"the new one is actor {actor.id}")
    console.print(str(output))


def _told(change: ChangeFlags) -> list[tuple[str, tuple[Any, ...]]]:
    """The edits of this scene's actors in their order: the name of each, and what it takes."""
    several = {
        "Move": (change.move, 2),
        "Turn": (change.turn, 1),
        "Delay": (change.delay, 1),
        "Speed": (change.speed, 1),
        "Copy": (change.copy, 2),
    }
    return [
        *(("Remove", (id,)) for id in change.remove),
        *(
            (name, _numbers(f"--{name.lower()}", word, count))
            for name, (words, count) in several.items()
            for word in words
        ),
        *(("Recolour", _colour(word)) for word in change.recolour),
    ]


def _of_other(word: str) -> tuple[Any, ...]:
    """A folder, an id and a place of ``--insert``; the folder is there and holds a scene."""
    name, _, rest = word.rpartition("@")
    folder, _, id = name.rpartition(":")
    try:
        place = [float(part) for part in rest.split(",")]
    except ValueError:
        place = []
    if not folder or not id.isdecimal() or len(place) not in (2, 3):
        raise InputError(f"--insert {word}: expected {_PLACE}")
    check_there(Path(folder), SCENE)
    if not any((Path(folder) / inner).is_file() for inner in ("scene.json", "scene/scene.json")):
        raise InputError(f"--insert {word}: {folder} holds no scene; expected {SCENE}")
    return Path(folder), int(id), *place


def _before(out: Path, file: Path | None, undo: int) -> "Edits":
    """The edits of a file, which are of this scene; or none."""
    from dreamdrive.edit import Edits, digest_of_scene, read_edits

    folder = out if (out / "scene.json").is_file() else out / "scene"
    digest = digest_of_scene(folder)
    if file is None:
        if undo:
            raise InputError("--undo needs --edits FILE: the edits of which the last are left out")
        return Edits(digest, ())
    found = read_edits(file)
    if found.of != digest:
        raise InputError(
            f"--edits {file} is of another scene than {out}; give the folder that it was made of"
        )
    return found.less(undo)


def _numbers(flag: str, word: str, count: int) -> tuple[int | float, ...]:
    """An id and numbers, from ``3=0,2``."""
    name, _, rest = word.partition("=")
    try:
        numbers = [float(part) for part in rest.split(",")]
        if len(numbers) == count and name.strip().isdecimal():
            return (int(name), *numbers)
    except ValueError:
        pass
    wanted = {1: "ID=NUMBER, such as 3=0.5", 2: "ID=AHEAD,LEFT in metres, such as 3=0,2"}[count]
    raise InputError(f"{flag} {word}: expected {wanted}")


def _colour(word: str) -> tuple[int, tuple[float, float, float]]:
    name, _, colour = word.partition("=")
    try:
        red, green, blue = bytes.fromhex(colour.removeprefix("#"))
        return int(name), (red / 255, green / 255, blue / 255)
    except ValueError:
        raise InputError(f"--recolour {word}: expected ID=#RRGGBB, such as 3=#c02020") from None
