"""``dreamdrive data``: what data sets there are, what a folder of one holds, and whether it is whole."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import OmitArgPrefixes, OmitSubcommandPrefixes, Positional, arg

from dreamdrive.cli.terminal.arguments import DataSetName, commands_of
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.cli.terminal.tables import print_table
from dreamdrive.errors import InputError
from dreamdrive.files.given import DATASET, check_there
from dreamdrive.files.output import check_ending

if TYPE_CHECKING:
    from dreamdrive.data import Logs
    from dreamdrive.scene.street.log import Log

_BROKEN = 2
"""Exit code of a data set of which something is missing or broken."""


def list_(
    path: Annotated[Positional[Path | None], arg(metavar="PATH", help_behavior_hint="")] = None,
    *,
    dataset: Annotated[DataSetName | None, arg(help_behavior_hint="")] = None,
) -> None:
    """The kinds of recordings that are read, or the scenes at a path.

    Args:
        path: A folder of a data set.
        dataset: Which data set it is of; without it the one that recognises the path.
    """
    from dreamdrive.data.table import DATASETS

    console = plain()
    if path is None:
        rows = [(name, DATASETS.choose(name).about) for name in DATASETS]
        for name, about in rows:
            console.print(f"{name:<16}{about}")
        return
    for number, name in enumerate(_logs(path, dataset).names(path)):
        console.print(f"{number:<6}{name}")


def check(
    path: Annotated[Positional[Path], arg(metavar="PATH")],
    *,
    dataset: Annotated[DataSetName | None, arg(help_behavior_hint="")] = None,
    scene: Annotated[str | None, arg(metavar="NAME|N", help_behavior_hint="")] = None,
) -> None:
    """Whether all that the tables of a data set name is there; exit code 2 where something is not.

    Args:
        path: A folder of a data set.
        dataset: Which data set it is of; without it the one that recognises the path.
        scene: Which scene, by its name or number; without it all.
    """
    check_there(path, DATASET)
    from dreamdrive.data import choose_scene

    logs = _logs(path, dataset)
    names = logs.names(path)
    if scene is not None:
        names = (choose_scene(names, scene, path),)
    console, rows = plain(), list[tuple[str, ...]]()
    said: dict[str, list[str]] = {}
    with Bars(console) as bars:
        for number, name in enumerate(names):
            bars("scenes", number, len(names))
            try:
                log = logs.read(path, name)
            except InputError as error:
                said.setdefault(str(error), []).append(name)
                rows.append((name, *["-"] * (len(_COLUMNS) - 1)))
                continue
            rows.append(_row(log))
            for problem in log.problems:
                said.setdefault(problem, []).append(name)
            for note in log.notes:
                console.print(f"{name}: {note}")
        bars("scenes", len(names), len(names))
    print_table(console, str(path), _COLUMNS, rows)
    for problem, where in said.items():
        of = where[0] if len(where) == 1 else f"{len(where)} scenes"
        console.print(f"{of}: {problem}")
    console.print("all is there" if not said else "what is listed is missing or broken; the rest works")
    if said:
        sys.exit(_BROKEN)


_COLUMNS = ("scene", "seconds", "cameras", "pictures", "labelled times", "boxes", "lidar", "map", "metres")


def _row(log: "Log") -> tuple[str, ...]:
    import numpy as np

    path = log.world_from_ego[:, :2, 3]
    metres = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    return (
        log.name,
        f"{log.times_s[-1] - log.times_s[0]:.1f}",
        str(len(log.cameras)),
        str(sum(map(len, log.cameras))),
        str(len(log.times_s)),
        str(len(log.boxes)),
        str(len(log.sweeps)),
        "yes" if log.map else "no",
        f"{metres:.0f}",
    )


def show(
    path: Annotated[Positional[Path], arg(metavar="PATH")],
    *,
    output: Annotated[Path, arg(aliases=["-o"], metavar="FILE")],
    dataset: Annotated[DataSetName | None, arg(help_behavior_hint="")] = None,
    scene: Annotated[str | None, arg(metavar="NAME|N", help_behavior_hint="")] = None,
    step: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
) -> None:
    """Draw a scene of a data set: its cameras with boxes and lidar, and its layout from above.

    Args:
        path: A folder of a data set.
        output: Picture to write, NAME.png.
        dataset: Which data set it is of; without it the one that recognises the path.
        scene: Which scene, by its name or number.
        step: Which of its labelled times, counted from 0; without it the middle.
    """
    check_ending(output, ".png")
    check_there(path, DATASET)
    from dreamdrive.datasets.log_layout import layout_of_log
    from dreamdrive.show import draw_layout, draw_log, write_png

    log = _logs(path, dataset).open(path, scene)
    row = len(log.times_s) // 2 if step is None else step
    if not 0 <= row < len(log.times_s):
        raise InputError(f"--step {step}: {log.name} has the labelled times 0 to {len(log.times_s) - 1}")
    above = draw_layout(layout_of_log(log), float(log.times_s[-1]))
    write_png(output, draw_log(log, row, above))
    console = plain()
    for sentence in (*log.notes, *log.problems):
        console.print(sentence)
    console.print(str(output))


def _logs(path: Path, dataset: str | None) -> "Logs":
    """The drives of a data set; refuses a path that is a single recording."""
    check_there(path, DATASET)
    from dreamdrive.data.input import dataset_of
    from dreamdrive.data.table import DATASETS

    chosen = dataset_of(dataset, path)
    if chosen.logs is None:
        own = [DATASETS.choose(name) for name in DATASETS.own]
        kinds = "; ".join(each.about for each in own if each.logs is not None)
        raise InputError(f"{path} is {chosen.about}, without scenes and labels; expected {kinds}")
    return chosen.logs


_Data = commands_of({"list": list_, "check": check, "show": show})


def data(what: Annotated[_Data, OmitSubcommandPrefixes, OmitArgPrefixes]) -> None:  # pyright: ignore[reportInvalidTypeForm]
    """Data sets: nuScenes and others, as they lie on disk.

    Args:
        what: What to do.
    """
