"""``dreamdrive actors``: what moves in a scene, as a table and as pictures."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from dreamdrive.cli.scene import open_scene
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.cli.terminal.tables import fixed, print_table
from dreamdrive.files.given import SCENE, check_there
from dreamdrive.files.output import check_ending

if TYPE_CHECKING:
    from dreamdrive.scene.actor import Actor

_COLUMNS = (
    *("id", "kind", "length m", "width m", "height m", "km/h", "from s", "to s", "frames", "unsure m"),
    "far side",
)
_KM_H = 3.6


def actors(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    output: Annotated[Path | None, arg(aliases=["-o"], metavar="FILE", help_behavior_hint="")] = None,
) -> None:
    """List what moves in a scene: what it is, how large and how fast, when it is there, and how sure that is.

    Args:
        out: The folder that generate or edit wrote.
        output: Picture of each of them to write, NAME.png.
    """
    check_there(out, SCENE)
    if output is not None:
        check_ending(output, ".png")
    scene, console = open_scene(out), plain()
    if not scene.actors:
        console.print("nothing in this scene moves on a track")
        return
    print_table(console, str(out), _COLUMNS, [_row(actor) for actor in scene.actors])
    if output is not None:
        use_all_cores()
        from dreamdrive.show import draw_actors, write_png

        write_png(output, draw_actors(scene))
        console.print(str(output))


def _row(actor: "Actor") -> tuple[str, ...]:
    size = (None, None, None) if actor.box is None else actor.box.size_m.tolist()
    unsure = None if actor.spread_m is None else float(actor.spread_m.mean())
    return (
        str(actor.id),
        actor.kind,
        *(fixed(side, 1) for side in size),
        fixed(float(actor.track.speed_m_s.mean()), 0, _KM_H),
        fixed(actor.track.first_s, 1),
        fixed(actor.track.last_s, 1),
        str(len(actor.track.times_s)),
        fixed(unsure, 2),
        "mirrored" if actor.completed else "as seen",
    )
