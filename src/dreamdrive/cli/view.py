"""``dreamdrive view``: a scene in the browser."""

import time
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.console import Console
from tyro.conf import Positional, arg

from dreamdrive.cli.scene import open_scene
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import Terminated, use_all_cores
from dreamdrive.cli.terminal.tables import print_table
from dreamdrive.errors import InputError, installing
from dreamdrive.files.given import SCENE, check_there
from dreamdrive.files.output import check_writable

if TYPE_CHECKING:
    from dreamdrive.view import RunWatch, Viewer

_COLUMNS = ("scene", "frames", "MB", "actors", "made")
_PORTS = (0, 65535)
_LOOK_S = 1.0
_INTERRUPTED, _TERMINATED = 130, 143


def view(
    out: Annotated[Positional[Path | None], arg(metavar="OUT", help_behavior_hint="")] = None,
    *,
    port: Annotated[int, arg(metavar="N")] = 8080,
    host: Annotated[str, arg(metavar="ADDRESS")] = "localhost",
    during: bool = False,
    output: Annotated[Path, arg(aliases=["-o"], metavar="DIR")] = Path(),
) -> None:
    """Look at a scene in the browser: fly, play, pick and move actors, draw a path and render it.

    Without a folder the scenes below this one are listed.

    Args:
        out: The folder that generate wrote.
        port: Of the page, at http://localhost:PORT; 0 is any that is free.
        host: Where the page can be reached from: localhost is this machine alone; with any other address the
            page needs the token that is printed with it.
        during: The folder is one that generate is still working on, or is about to: show what there is.
        output: Folder for what is saved on the page.
    """
    console = plain()
    if out is None:
        _list(console)
        return
    _check(out, port, during, output)
    use_all_cores()
    from dreamdrive.view import Desk, listen, view_run, view_scene

    scene = None if during else open_scene(out)
    listening, desk, watch = listen(host, port), Desk(output.resolve(), out), None
    if scene is None:
        viewer, watch = view_run(out, host, listening, desk)
    else:
        viewer = view_scene(scene, out, host, listening, desk)
    console.print(
        f"{out} is shown at {viewer.address} until Ctrl-C; what is saved there goes to {desk.folder}"
    )
    _serve(viewer, watch, console)


def _check(out: Path, port: int, during: bool, output: Path) -> None:
    """Mistakes that show before anything slow is loaded."""
    if not during:
        check_there(out, SCENE)
        if not ((out / "scene.json").is_file() or (out / "scene").is_dir()):
            raise InputError(
                f"{out} holds no scene; expected {SCENE}. While generate works on one, give --during"
            )
    if not _PORTS[0] <= port <= _PORTS[1]:
        raise InputError(f"--port {port}: expected {_PORTS[0]} to {_PORTS[1]}")
    if output.exists() and not output.is_dir():
        raise InputError(f"--output {output} is a file; expected a folder")
    check_writable(output)
    if find_spec("viser") is None:
        raise InputError(f"dreamdrive view needs viser: {installing('view')}")


def _serve(viewer: "Viewer", watch: "RunWatch | None", console: Console) -> None:
    """Until somebody asks it to end."""
    try:
        while True:
            if watch is not None and watch.look():
                watch = None
            time.sleep(_LOOK_S)
    except KeyboardInterrupt as asked:
        console.print("the page is closed")
        raise SystemExit(_TERMINATED if isinstance(asked, Terminated) else _INTERRUPTED) from None
    finally:
        viewer.close()


def _list(console: Console) -> None:
    """The scenes below this folder, and how to open one."""
    from dreamdrive.view import scenes_below

    found = scenes_below(Path())
    if not found:
        raise InputError(f"there is no scene below {Path().resolve()}; give {SCENE}: dreamdrive view OUT")
    rows = [
        (
            str(each.path),
            str(each.frames),
            f"{each.bytes / 1e6:.1f}",
            str(each.actors),
            f"{each.changed:%Y-%m-%d %H:%M}",
        )
        for each in found
    ]
    print_table(console, "Scenes below this folder", _COLUMNS, rows)
    console.print(f"open one with: dreamdrive view {found[0].path}")
