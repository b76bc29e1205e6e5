"""``dreamdrive look``: what the street network sees in a photo or a clip."""

import time
from dataclasses import dataclass
from functools import partial
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg

from dreamdrive.cli.terminal.arguments import parse_size
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.errors import InputError
from dreamdrive.files.given import check_given
from dreamdrive.files.kinds import LOOK_KIND
from dreamdrive.files.output import check_free

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import UInt8

    from dreamdrive.scene.street.look import CameraEstimate, Look

_PIXEL_BYTES = 16
"""Of one frame with all that is seen in it."""


@dataclass(frozen=True)
class _Pictures:
    """Frames, their calibrated focal length in pixels if there is one, and what to say of them."""

    frames: "UInt8[np.ndarray, 'f h w 3']"
    focal_px: float | None
    each: list[dict[str, Any]]
    notes: list[str]


def look(
    input: Annotated[Positional[Path], arg(metavar="PHOTO|CLIP")],
    *,
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    knowledge: Annotated[str, arg(metavar="street|FILE")] = "street",
    frames: Annotated[str | None, arg(metavar="START:STOP:STEP", help_behavior_hint="")] = None,
    size: Annotated[str | None, arg(metavar="WxH", help_behavior_hint="")] = None,
    intrinsics: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    hfov: Annotated[float | None, arg(metavar="DEG", help_behavior_hint="")] = None,
    camera_height: Annotated[float | None, arg(metavar="M", help_behavior_hint="")] = None,
    force: bool = False,
) -> None:
    """See depth, classes, road users and the camera in a photo or a clip, without any geometry.

    Args:
        input: A photo, a video, or a folder of images.
        out: Folder to write.
        knowledge: The network: dreamdrive's own, or a file of its weights.
        frames: Frames of a clip to look at, counted from 0.
        size: Size of the frames; without it 480 wide.
        intrinsics: Calibration of the camera: JSON for the size of the input, COLMAP model, transforms.json.
        hfov: Horizontal field of view, where there is no calibration.
        camera_height: Height of the camera above the road in metres; without it depth is in such heights.
        force: Replace what is there already from an earlier look.
    """
    wanted = None if size is None else parse_size(size)
    check_given(input=input, intrinsics=intrinsics)
    check_free(out, force, LOOK_KIND)
    use_all_cores()
    from dreamdrive.show import draw_look
    from dreamdrive.street_network import load_knowledge, look as see, write_look

    network = load_knowledge(knowledge)
    given = _read(input, frames, wanted, intrinsics, hfov)
    _check_memory(given)
    console, start = plain(), time.perf_counter()
    with Bars(console) as bars:
        seen = see(
            given.frames,
            network,
            focal_px=given.focal_px,
            camera_height_m=camera_height,
            tell=partial(bars, "look"),
        )
        seconds = time.perf_counter() - start

        def pictures():
            for index, frame in enumerate(given.frames):
                yield draw_look(frame, seen, index)
                bars("write", index + 1, len(seen))

        about = {"source": str(input), "knowledge": knowledge, "notes": given.notes}
        write_look(seen, out, pictures(), given.each, about, replace=force)
    for line in (*given.notes, _camera(seen.camera), _road_users(seen)):
        console.print(line)
    console.print(f"{out}: {len(seen)} frames in {seconds:.1f} s, {seconds / len(seen):.2f} s a frame")


def _read(
    path: Path, frames: str | None, size: tuple[int, int] | None, intrinsics: Path | None, hfov: float | None
) -> _Pictures:
    from dreamdrive.data import read_clip
    from dreamdrive.data.frames.size import choose_size
    from dreamdrive.data.photo import is_photo, read_photo
    from dreamdrive.data.pictures.images import read_image

    if is_photo(path):
        if frames is not None:
            raise InputError(f"--frames {frames}: {path} is one photo; give --frames with a clip")
        wanted = choose_size(read_image(path).size, size).target
        photo = read_photo(path, wanted, intrinsics, hfov)
        focal_px = photo.camera.fx_px if photo.calibrated or photo.hfov else None
        notes = _without_guesses(photo.notes)
        return _Pictures(photo.rgb[None], focal_px, [{"source_index": 0, "time_s": 0.0}], notes)
    clip = read_clip(path, frames=frames, size=size, intrinsics=intrinsics, hfov_deg=hfov)
    focal_px = clip.rig[0].fx_px if clip.known.focal else None
    rows = zip(clip.source_index.tolist(), clip.times_s.tolist(), strict=True)
    each = [{"source_index": index, "time_s": time_s} for index, time_s in rows]
    return _Pictures(clip.frames, focal_px, each, _without_guesses(clip.provenance["notes"]))


def _without_guesses(notes: "list[str] | tuple[str, ...]") -> list[str]:
    """What readers say, but of the focal length that they guess: the network tells a better one."""
    return [note for note in notes if not note.startswith("No calibration: the focal length is taken")]


def _check_memory(given: _Pictures) -> None:
    """Refuse more frames than memory holds, before they are looked at."""
    from dreamdrive.compute.machine import free_bytes

    needed, free = _PIXEL_BYTES * given.frames[..., 0].size, free_bytes()
    if free is not None and needed > free:
        raise InputError(
            f"what is seen in {len(given.frames)} frames takes about {needed / 1e9:.1f} GB of memory, and "
            f"{free / 1e9:.1f} GB are free; choose fewer with --frames START:STOP:STEP, or a smaller --size"
        )


def _camera(camera: "CameraEstimate") -> str:
    given = ", given" if camera.focal_spread == 0 else f" (focal length +-{100 * camera.focal_spread:.0f} %)"
    return (
        f"field of view {degrees(camera.hfov_rad):.1f} degrees{given}, looks up "
        f"{degrees(camera.pitch_rad):+.1f} degrees, turned {degrees(camera.roll_rad):+.1f} degrees clockwise"
    )


def _road_users(seen: "Look") -> str:
    count = sum(map(len, seen.road_users)) / len(seen)
    scale = "camera heights (give --camera-height for metres)"
    unit = scale if seen.camera_height_m is None else "metres"
    return f"{count:.1f} road users a frame; depth in {unit}"
