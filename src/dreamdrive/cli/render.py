"""``dreamdrive render``: new drives through a scene as videos, pictures or arrays."""

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from dreamdrive.cli.scene import blurring, less, open_scene
from dreamdrive.cli.terminal.arguments import DeviceFlag, parse_size
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.cli.trust import believed, bent, trust_of
from dreamdrive.errors import InputError
from dreamdrive.files.given import SCENE, WANTED, check_there
from dreamdrive.names import Format, Show
from dreamdrive.scene.control import check_numbers, check_render_size


@dataclass(frozen=True)
class ShownFlags:
    """What is shown.

    Attributes:
        show: Everything, its depth, what moves or what stands alone, or how far it can be believed: red is
            not to be.
        completion: Whether guesses are shown where no frame saw anything.
        size: Size of the frames; the horizontal field of view stays. Without it that of the recording.
        without: Leave a moving thing out, by the id that scene.json gives it. It may be given several times.
        restore: Mend views with what the recorded frames show of the same surfaces, by weights of dreamdrive
            train restorer.
        blur: Make heads of people and plates of vehicles coarse, as far as the street network finds them.
    """

    show: Show = "colour"
    completion: bool = True
    size: Annotated[str | None, arg(metavar="WxH", help_behavior_hint="")] = None
    without: Annotated[UseAppendAction[tuple[int, ...]], arg(metavar="ID", help_behavior_hint="")] = ()
    restore: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None
    blur: bool = False


def render(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    trajectory: Annotated[
        UseAppendAction[tuple[str, ...]], arg(metavar="NAME|FILE", help_behavior_hint="(required)")
    ],
    shift_m: Annotated[float, arg(metavar="M")] = 2.0,
    shown: OmitArgPrefixes[ShownFlags] = ShownFlags(),
    format: Format = "mp4",
    fps: Annotated[float | None, arg(metavar="F", help_behavior_hint="")] = None,
    stay_within_trust: bool = False,
    device: DeviceFlag = "cpu",
    output: Annotated[Path | None, arg(aliases=["-o"], metavar="FILE.mp4|DIR", help_behavior_hint="")] = None,
) -> None:
    """Drive through a scene and write videos, pictures or arrays.

    Args:
        out: The folder that generate wrote.
        trajectory: forward, left, right, stop, lane-left, lane-right, shift, or a file with a trajectory. It
            may be given several times.
        shift_m: How far shift goes to the right in metres; negative is to the left.
        shown: What is shown.
        format: A video, or a folder with a picture or with exact arrays a frame.
        fps: Frames a second; without it a file's own, and for the others 20 at least.
        stay_within_trust: Bend drives towards the recorded one where less than 22 dB is to be expected.
        device: Where pictures are drawn; cuda takes an NVIDIA GPU and gsplat (docs/gpu.md). Trust is told on
            the CPU.
        output: The video or folder, of several trajectories a folder for all; without it OUT/video.
    """
    if not trajectory:
        raise InputError("render needs a drive: give --trajectory NAME|FILE, such as --trajectory shift")
    wanted = None if shown.size is None else parse_size(shown.size)
    if wanted is not None:
        check_render_size(wanted, video=format == "mp4")
    check_numbers(shift_m, fps)
    if shown.blur and (format == "npz" or shown.show == "depth"):
        raise InputError("--blur changes colours in pictures; leave it out with npz and with --show depth")
    if shown.restore is not None and shown.show != "colour":
        raise InputError(f"--restore mends colours; leave it out with --show {shown.show}")
    check_there(shown.restore, WANTED["weights"])
    check_there(out, SCENE)
    use_all_cores()
    from dreamdrive.compute.device import computing_on
    from dreamdrive.drive import drives_of
    from dreamdrive.restore import Restorer
    from dreamdrive.show import RenderOptions, places, video_rate, write_drive
    from dreamdrive.splat import why_unusable

    with computing_on(device, why_unusable) as where:
        options = RenderOptions(shown.show, format, wanted, fps, blurring() if shown.blur else None)
        whole = open_scene(out)
        scene = less(whole if shown.completion else whole.without_filled(), shown.without)
        drives = drives_of(scene, trajectory, shift_m, fps)
        needed = shown.show == "trust" or shown.restore is not None or stay_within_trust
        trust = trust_of(scene, drives, needed=needed)
        if stay_within_trust and trust is not None:
            drives = [bent(drive, trust) for drive in drives]
        if format == "mp4":
            for drive in drives:
                video_rate(drive, options)
        there, console = scene.on(where), plain()
        restorer = None
        if trust is not None and shown.restore is not None:
            restorer = Restorer.of(there, trust.evidence, shown.restore, where)
        for drive, place in zip(drives, places(out, output, drives, options), strict=True):
            start, count = time.perf_counter(), len(drive.path)
            with Bars(console) as bars:
                write_drive(
                    place, there, drive, options, partial(bars, "render", total=count), trust, restorer
                )
            seconds = time.perf_counter() - start
            rate = f"{count} frames in {seconds:.2f} s, {count / seconds:.1f} frames/s"
            console.print(f"{place}: {rate}")
    if trust is not None:
        console.print(believed(trust))
