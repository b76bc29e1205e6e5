"""The prior that ships in the box: a drive through a procedural street, drawn at random or given."""

from dataclasses import replace

import numpy as np

from dreamdrive.data.layout_file import read_layout
from dreamdrive.data.select import Selection, held_out_mask
from dreamdrive.data.size import check_largest
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.protocol import Prior
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Control
from dreamdrive.world import StreetOptions, draw_street, drive

FRAMES = 24
"""Length of the drive unless ``control.frames`` says where to stop."""
RATE_HZ = 10.0
"""Rate unless told."""
SIZE = (320, 192)
"""Width and height unless told."""


def street_world(control: Control, progress: Progress = silent) -> Clip:
    """A clip of simulated frames, as a calibrated dashcam gives it; Z_ref is ``features["appearance"]``.

    The street is that of the layout ``control.path``, or one that ``control.seed`` decides.
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
    made, index = drive(layout, count, fps, size, progress=progress), np.array(wanted)
    frames, valid = made.frames[index], np.ones((len(index), *size[::-1]), dtype=bool)
    provenance = {
        "prior": "street-world",
        "seed": control.seed,
        "notes": [
            f"The references are simulated: frames of {source}, handed over with exact intrinsics only."
        ],
    }
    return Clip(
        frames=frames,
        times_s=made.times_s[index] - made.times_s[index[0]],
        camera=np.zeros(len(index), dtype=np.int64),
        rig=(made.cameras[index[0]].at(np.eye(4)),),
        valid=valid,
        held_out=held_out_mask(len(index), control.hold_out),
        source_index=index,
        features={"appearance": appearance(frames, valid)},
        known=Known(intrinsics=True),
        provenance=provenance,
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
