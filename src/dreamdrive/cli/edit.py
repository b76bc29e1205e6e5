"""``dreamdrive edit``: a scene with its actors removed, moved, turned, delayed, copied or painted."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

from rich.console import Console
from tyro.conf import Positional, UseAppendAction, arg

from dreamdrive.cli.scene import open_scene
from dreamdrive.errors import InputError
from dreamdrive.files.given import SCENE, check_given, check_there
from dreamdrive.files.kinds import EDITED_KIND
from dreamdrive.files.output import check_free, check_place

if TYPE_CHECKING:
    from dreamdrive.edit import Edit, Edits

_NOTHING = "there is nothing to change; give --remove ID, --move ID=AHEAD,LEFT or another edit"
_Ids = UseAppendAction[tuple[int, ...]]
_Words = UseAppendAction[tuple[str, ...]]


def edit(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    output: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    remove: Annotated[_Ids, arg(metavar="ID", help_behavior_hint="")] = (),
    move: Annotated[_Words, arg(metavar="ID=AHEAD,LEFT", help_behavior_hint="")] = (),
    turn: Annotated[_Words, arg(metavar="ID=DEGREES", help_behavior_hint="")] = (),
    delay: Annotated[_Words, arg(metavar="ID=SECONDS", help_behavior_hint="")] = (),
    speed: Annotated[_Words, arg(metavar="ID=FACTOR", help_behavior_hint="")] = (),
    copy: Annotated[_Words, arg(metavar="ID=AHEAD,LEFT", help_behavior_hint="")] = (),
    recolour: Annotated[_Words, arg(metavar="ID=#RRGGBB", help_behavior_hint="")] = (),
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
        remove: Leave it out.
        move: So many metres ahead of and to the left of where it is, as it points; negative is behind, right.
        turn: Turned to the left where it is.
        delay: Later, or earlier where negative.
        speed: So many times as fast.
        copy: A second one, elsewhere as move has it; its id is printed.
        recolour: In one colour.
        edits: Make those of this file first: edits.json of an edited scene.
        undo: Leave out so many of its last ones.
        force: Replace an edited scene that is there.
    """
    check_there(out, SCENE)
    check_given(edits=edits)
    told = _told(remove, move, turn, delay, speed, copy, recolour)
    if not told and edits is None and not undo:
        raise InputError(_NOTHING)
    check_place(output, out)
    check_free(output, force, EDITED_KIND)
    from dreamdrive import edit as package

    before = _before(out, edits, undo)
    new = tuple(cast("Edit", getattr(package, name)(*values)) for name, values in told)
    if not new and not before.edits:
        raise InputError(_NOTHING)
    scene = open_scene(out)
    made = package.write_edited(scene, before.and_then(new), output, replace=force)
    console = Console(highlight=False, soft_wrap=True, markup=False)
    known = {actor.id for actor in scene.actors}
    for actor in made.actors:
        if actor.id not in known:
            console.print(f"the new one is actor {actor.id}")
    console.print(str(output))


def _told(
    remove: Iterable[int],
    move: Iterable[str],
    turn: Iterable[str],
    delay: Iterable[str],
    speed: Iterable[str],
    copy: Iterable[str],
    recolour: Iterable[str],
) -> list[tuple[str, tuple[Any, ...]]]:
    """The edits of the flags in their order: the name of each, and what it takes."""
    several = {
        "Move": (move, 2),
        "Turn": (turn, 1),
        "Delay": (delay, 1),
        "Speed": (speed, 1),
        "Copy": (copy, 2),
    }
    return [
        *(("Remove", (id,)) for id in remove),
        *(
            (name, _numbers(f"--{name.lower()}", word, count))
            for name, (words, count) in several.items()
            for word in words
        ),
        *(("Recolour", _colour(word)) for word in recolour),
    ]


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
