"""``dreamdrive render``: a new drive through a scene as a video."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.console import Console
from tyro.conf import Positional, arg

from dreamdrive.cli.machine import use_all_cores
from dreamdrive.cli.progress import Bars
from dreamdrive.cli.scene import open_scene
from dreamdrive.errors import InputError

if TYPE_CHECKING:
    from dreamdrive.scene.scene import Scene
    from dreamdrive.scene.trajectory import Trajectory


def render(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    trajectory: Annotated[str, arg(metavar="NAME|FILE")],
    shift_m: Annotated[float, arg(metavar="M")] = 2.0,
    output: Annotated[Path | None, arg(aliases=["-o"], metavar="FILE.mp4")] = None,
) -> None:
    """Drive through a scene and write a video.

    Args:
        out: The folder that generate wrote.
        trajectory: forward, left, right, stop, lane-left, lane-right, shift, or a file with a trajectory.
        shift_m: How far shift goes to the right in metres; negative is to the left.
        output: The video; without it OUT/video/NAME.mp4.
    """
    use_all_cores()
    from dreamdrive.data.video_writer import write_video
    from dreamdrive.pictures import drive_frames, frame_rate

    scene = open_scene(out)
    name, drive = _drive(scene, trajectory, shift_m)
    target = out / "video" / f"{name}.mp4" if output is None else output
    if target.suffix.lower() != ".mp4":
        raise InputError(f"-o {target}: expected a name that ends in .mp4")
    console = Console()
    start = time.perf_counter()
    with Bars(console) as bars:

        def shown() -> Iterator[object]:
            for done, frame in enumerate(drive_frames(scene, drive)):
                yield frame
                bars("render", done + 1, len(drive))

        count = write_video(target, shown(), frame_rate(drive))  # pyright: ignore[reportArgumentType]
    seconds = time.perf_counter() - start
    rate = f"{count} frames in {seconds:.2f} s, {count / seconds:.1f} frames/s"
    console.print(f"{target}: {rate}", soft_wrap=True)


def _drive(scene: "Scene", trajectory: str, shift_m: float) -> tuple[str, "Trajectory"]:
    """Name and poses of what ``--trajectory`` asks for; manoeuvres run at the smooth rate of ``generate``."""
    from dreamdrive.data import read_trajectory
    from dreamdrive.drive import MANOEUVRES, manoeuvre
    from dreamdrive.pictures import smooth, up_of

    if trajectory in MANOEUVRES:
        return trajectory, manoeuvre(trajectory, smooth(scene.trajectory), up_of(scene), shift_m)
    path = Path(trajectory)
    if not path.exists():
        raise InputError(
            f"--trajectory {trajectory}: no such file; expected a file with a trajectory or one of "
            f"{', '.join(MANOEUVRES)}"
        )
    return path.stem, read_trajectory(path)
