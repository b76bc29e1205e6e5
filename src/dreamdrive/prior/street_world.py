"""The prior that ships in the box: a drive through a procedural street, drawn at random or given."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from dreamdrive.data.layout_file import read_layout
from dreamdrive.data.select import Selection, held_out_mask
from dreamdrive.data.size import check_largest
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.protocol import Prior
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Control
from dreamdrive.world import Drive, StreetOptions, draw_street, drive

FRAMES = 24
"""Length of the drive unless ``control.frames`` says where to stop."""
RATE_HZ = 10.0
"""Rate unless told."""
SIZE = (320, 192)
"""Width and height unless told."""


def street_world(control: Control, progress: Progress = silent, *, truth: bool = False) -> Clip:
    """A clip of simulated frames; Z_ref is ``features["appearance"]``.

    The street is that of the layout ``control.path``, or one that ``control.seed`` decides.

    Args:
        control: Layout or seed, frames, rate, size, withheld frames.
        progress: Told of every frame.
        truth: Whether the exact poses, depth and sky are handed over. Without them the clip is what a
            calibrated dashcam would give, and the reconstruction has to find them.

    Raises:
        InputError: The layout is wrong, the size is odd, or the frames
            cannot be selected.
    """
    size = control.size or SIZE
    if size[0] % 2 or size[1] % 2:
        raise InputError(f"--size {size[0]}x{size[1]}: expected even numbers, such as {SIZE[0]}x{SIZE[1]}")
    check_largest(size, f"--size {size[0]}x{size[1]}")
    selection = Selection.parse(control.frames)
    if selection.stop is None:
        selection = replace(selection, stop=max(FRAMES, selection.start + FRAMES))
    wanted = list(selection.resolve(FRAMES if selection.needs_count else None, "the street"))
    count, fps = wanted[-1] + 1, control.fps or RATE_HZ
    if control.path is None:
        layout = draw_street(control.seed, StreetOptions(seconds=count / fps))
        source = f"a procedural street, seed {control.seed}"
    else:
        layout = read_layout(control.path)
        source = f"the layout {control.path.name}"
    clip = _clip(drive(layout, count, fps, size, progress=progress), np.array(wanted), truth)
    provenance = {
        "prior": "street-world",
        "seed": control.seed,
        "notes": [
            f"The references are simulated: frames of {source}, handed over with "
            f"{'exact poses and depth' if truth else 'exact intrinsics only'}."
        ],
    }
    held_out = held_out_mask(len(wanted), control.hold_out)
    clip = replace(clip, held_out=held_out, provenance=provenance)
    return clip.with_features(appearance=appearance(clip.frames, clip.valid))


def _clip(made: Drive, index: np.ndarray, truth: bool) -> Clip:
    """Some frames of a drive; time 0 and the world are those of the first of them."""
    first = made.cameras[index[0]]
    known = Known(intrinsics=True)
    if truth:
        poses = first.camera_from_world @ made.trajectory.world_from_camera[index]
        poses[0] = np.eye(4)
        known = Known(poses, intrinsics=True, depth_m=made.depth_m[index], sky=made.sky[index])
    frames = made.frames[index]
    nothing: Bool[np.ndarray, " f"] = np.zeros(len(index), dtype=bool)
    return Clip(
        frames=frames,
        times_s=made.times_s[index] - made.times_s[index[0]],
        camera=np.zeros(len(index), dtype=np.int64),
        rig=(first.at(np.eye(4)),),
        valid=np.ones(frames.shape[:3], dtype=bool),
        held_out=nothing,
        source_index=index,
        known=known,
    )


STREET_WORLD = Prior(
    name="street-world",
    make=street_world,
    takes=frozenset({"path", "frames", "fps", "size", "hold_out"}),
    gives="exact intrinsics",
    about="a drive through a layout, or through a street drawn at random; its frames are simulated",
    licence="Apache-2.0, as all of dreamdrive",
    memory="0.5 GB for 24 frames at 480x270",
)
