"""``dreamdrive world``: streets with exact truth."""

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import OmitArgPrefixes, OmitSubcommandPrefixes, arg

from dreamdrive.cli.terminal.arguments import commands_of, parse_size
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.compute.machine import free_bytes
from dreamdrive.errors import InputError
from dreamdrive.files.given import check_given
from dreamdrive.files.kinds import WORLD_KIND
from dreamdrive.files.output import check_free

if TYPE_CHECKING:
    from dreamdrive.scene.street.truth import DriveTruth, Mount

_PIXEL_BYTES = 22
"""Of one frame and its truth: colour, depth, flow and labels."""


def make(
    *,
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    seed: Annotated[int, arg(metavar="S")] = 0,
    edition: Annotated[int, arg(metavar="N")] = 1,
    layout: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    frames: Annotated[int, arg(metavar="N")] = 24,
    fps: Annotated[float, arg(metavar="F")] = 10.0,
    size: Annotated[str, arg(metavar="WxH")] = "320x192",
    cameras: Literal["front", "surround"] = "front",
    corrupt: Annotated[str | None, arg(metavar="TEXT", help_behavior_hint="")] = None,
    one_ray: bool = False,
    force: bool = False,
) -> None:
    """Draw a street, drive through it, and write frames with all truth.

    Args:
        out: Folder to write.
        seed: Decides the street.
        edition: Which edition of streets; each draws the same for ever. A layout names its own.
        layout: Draw this street instead, see docs/layout.md.
        frames: Number of frames.
        fps: Frames a second.
        size: Size of the frames.
        cameras: front is one camera; surround six, each in a folder of its own.
        corrupt: Draw the frames as a video model might have, such as generated or warp=0.5,flicker=1, see
            docs/reference/corruptions.md; the truth stays that of the clean street.
        one_ray: One ray a pixel, twice as fast, with rough edges.
        force: Replace a world that is there already.
    """
    wanted = parse_size(size)
    _check_numbers(frames, fps, seed, wanted)
    check_given(layout=layout)
    check_free(out, force, WORLD_KIND)
    use_all_cores()
    from dreamdrive.data.layout_file import read_layout
    from dreamdrive.scene.street.truth import MOUNTS
    from streetworld import StreetOptions, World, corruption, draw_street, drive, write_world

    count = frames * (len(MOUNTS) if cameras == "surround" else 1)
    _check_memory(count, wanted, free_bytes())
    drawn = StreetOptions(frames / fps, edition=edition)
    street = draw_street(seed, drawn) if layout is None else read_layout(layout)
    wrong = None if corrupt is None else corruption.parse_corruption(corrupt, street.seed)
    world = World(street)
    console, start = plain(), time.perf_counter()
    with Bars(console) as bars:
        drives: dict[Mount, DriveTruth] = {
            mount: drive(
                street,
                frames,
                fps,
                wanted,
                world=world,
                mount=mount,
                antialiased=not one_ray,
                progress=lambda done, total, name=mount: bars(name, done, total),
            )
            for mount in (MOUNTS if cameras == "surround" else MOUNTS[:1])
        }
    seconds = time.perf_counter() - start
    if wrong is not None:
        drives = {
            mount: replace(made, frames=corruption.corrupt(made.frames, wrong, made.depth_m))
            for mount, made in drives.items()
        }
    write_world(drives, out, corruption=wrong, replace=force)
    console.print(f"{out}: {count} frames in {seconds:.1f} s, {count / seconds:.1f} frames/s")


def _check_numbers(frames: int, fps: float, seed: int, size: tuple[int, int]) -> None:
    """Refuse what no world can be drawn with."""
    if frames < 1 or not 0 < fps < float("inf") or seed < 0 or min(size) < 16:
        raise InputError(
            f"--frames {frames} --fps {fps:g} --seed {seed} --size {size[0]}x{size[1]}: expected at least "
            "one frame, a positive rate, a seed of 0 or more and at least 16x16 pixels"
        )


def _check_memory(count: int, size: tuple[int, int], free: int | None) -> None:
    """Refuse a world that memory cannot hold, before it is drawn."""
    needed = count * size[0] * size[1] * _PIXEL_BYTES
    if free is not None and needed > free:
        raise InputError(
            f"{count} frames of {size[0]}x{size[1]} need about {needed / 1e9:.1f} GB of memory with their "
            f"truth, and {free / 1e9:.1f} GB are free; give fewer --frames or a smaller --size"
        )


_World = commands_of({"make": make})


def world(what: Annotated[_World, OmitSubcommandPrefixes, OmitArgPrefixes]) -> None:  # pyright: ignore[reportInvalidTypeForm]
    """Streets with exact truth.

    Args:
        what: What to do.
    """
