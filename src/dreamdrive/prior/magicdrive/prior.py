"""The priors ``magicdrive`` and ``magicdrive-t``: six cameras from a layout (Gao et al., ICLR 2024)."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.layout_file import read_layout
from dreamdrive.data.select import Selection, held_out_mask
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.magicdrive.cameras import NUSCENES, car_from_camera, map_from_car, rig
from dreamdrive.prior.magicdrive.condition import check_map, prompt_of
from dreamdrive.prior.magicdrive.config import EXPECTED
from dreamdrive.prior.protocol import Prior
from dreamdrive.prior.running import INSTALL, PACKAGE, enough_memory
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Control
from dreamdrive.scene.layout import Layout
from dreamdrive.scene.trajectory import Trajectory

RATE_HZ = 12.0
"""Rate that the temporal variant was trained at, and that of single time steps unless told."""
TIME_STEPS = 16
"""Time steps unless ``control.frames`` says where to stop."""
STEPS = 20
"""Steps of the sampler unless told."""
MOST_STEPS = 1000
"""Those of the training."""
CAMERAS = len(NUSCENES)


def magicdrive(control: Control, progress: Progress = silent, *, temporal: bool = False) -> Clip:
    """Six pictures of every time step, each of them sampled by itself, or all together.

    Always sampled together is the whole length of the weights, at 12 Hz from the layout's time 0.
    """
    layout, weights = _inputs(control)
    wanted = None if temporal else _time_steps(control, None)
    rate_hz = RATE_HZ if control.fps is None else control.fps
    if not rate_hz > 0:
        raise InputError(f"--fps {rate_hz:g}: expected more than 0")
    try:
        from dreamdrive.prior.magicdrive.folder import read_parts
        from dreamdrive.prior.magicdrive.sample import Run, generate
    except ImportError as error:
        raise InputError(f"the prior magicdrive cannot start ({error}): {INSTALL}") from None
    with enough_memory("take the weights for 400x224, which need least, or a GPU with more memory"):
        parts = read_parts(weights, temporal=temporal)
        wanted = _time_steps(control, parts.settings.frames) if wanted is None else wanted
        steps = STEPS if control.steps is None else control.steps
        run = Run(layout, parts, prompt_of(control.prompt), steps, control.seed, rate_hz)
        frames, latents = generate(run, wanted, progress)
    valid = np.ones(frames.shape[:3], dtype=bool)
    return Clip(
        frames=frames,
        valid=valid,
        held_out=np.repeat(held_out_mask(len(wanted), control.hold_out), CAMERAS),
        latents=latents,
        source_index=np.repeat(wanted, CAMERAS),
        features={"appearance": appearance(frames, valid)},
        provenance=_provenance(control, layout, temporal) | run.about(),
        **_cameras(layout, wanted / rate_hz, parts.settings.size, temporal),
    )


def _time_steps(control: Control, count: int | None) -> Int[np.ndarray, " t"]:
    """The time steps to make, of as many as there are, if that is given by the weights."""
    selection = Selection.parse(control.frames)
    if count is not None:
        wanted = selection.resolve(count, "the clip of these weights")
    else:
        if selection.stop is None:
            selection = replace(selection, stop=max(TIME_STEPS, selection.start + TIME_STEPS))
        wanted = selection.resolve(TIME_STEPS if selection.needs_count else None, "the drive")
    held_out_mask(len(wanted), control.hold_out)  # complains before anything is loaded or made
    return np.array(wanted)


def _inputs(control: Control) -> tuple[Layout, Path]:
    """The layout and the folder of weights."""
    if control.weights is None:
        raise InputError(f"the prior magicdrive needs --weights, {EXPECTED}")
    if control.steps is not None and control.steps > MOST_STEPS:
        raise InputError(f"--steps {control.steps}: expected at most {MOST_STEPS}, such as {STEPS}")
    if control.path is None:
        raise InputError(
            "the prior magicdrive needs a layout: a JSON, see docs/layout.md; dreamdrive world make draws one"
        )
    layout = read_layout(control.path)
    check_map(layout, str(control.path))
    return layout, control.weights


def _cameras(
    layout: Layout, times_s: Float[np.ndarray, " t"], size: tuple[int, int], temporal: bool
) -> dict[str, Any]:
    """Times, rig and the path by time, then camera; the world is the front camera of the first time step.

    Time steps that were sampled together may show how the cameras move, which is for the geometry to find.
    Those that were sampled one by one cannot: their poses are taken as asked for.
    """
    pinholes = rig(size)
    map_from_front = map_from_car(layout.ego, times_s) @ car_from_camera(NUSCENES[0])
    world_from_front = np.linalg.inv(map_from_front[0]) @ map_from_front
    world_from_front[0] = np.eye(4)
    mounted = np.stack([camera.world_from_camera for camera in pinholes])
    poses = None if temporal else (world_from_front[:, None] @ mounted).reshape(-1, 4, 4)
    since_s = times_s - times_s[0]
    return {
        "times_s": np.repeat(since_s, CAMERAS),
        "camera": np.tile(np.arange(CAMERAS), len(times_s)),
        "rig": pinholes,
        "known": Known(poses, intrinsics=True, generated=True),
        "requested": Trajectory(world_from_front, since_s),
    }


def _provenance(control: Control, layout: Layout, temporal: bool) -> dict[str, Any]:
    name = "magicdrive-t" if temporal else "magicdrive"
    source = "a layout" if control.path is None else f"the layout {control.path.name}"
    return {
        "prior": name,
        "cameras": [camera.name for camera in NUSCENES],
        "notes": [
            f"The frames are generated from {source} by {name}, six cameras at each time step, for "
            "intrinsics, mountings and a path that a generated picture follows only roughly.",
            _TOGETHER if temporal else _ALONE,
            f"The cameras are typical ones of nuScenes, the front one {NUSCENES[0].place_m[2]:g} m high; the "
            f"layout's camera height of {layout.ego.camera_height_m:g} m and its shaking are not followed.",
        ],
    }


_TOGETHER = (
    "All time steps were sampled together; frames agree in time as far as the network learned it. The path "
    "is looked for in them, and the report compares it with the one asked for."
)
_ALONE = (
    "Each time step was sampled by itself, from the same noise: beyond map, boxes and noise nothing ties one "
    "to the next, and what the layout leaves open (houses, colours, sky) changes from step to step. No "
    "motion can be seen in such frames: the poses are those that they were asked for."
)

MAGICDRIVE = Prior(
    name="magicdrive",
    make=magicdrive,
    takes=frozenset({"path", "frames", "prompt", "steps", "hold_out", "fps"}),
    gives="six cameras at each time step, the intrinsics, mountings and path asked for, latents",
    about="six cameras from a layout by MagicDrive, each time step by itself",
    licence=(
        "ours; code and weights of MagicDrive Apache-2.0, trained on nuScenes (not for commercial use); "
        "Stable Diffusion 1.5 CreativeML Open RAIL-M"
    ),
    memory="for 400x224 about 7.5 GB on a CPU (float32), 4.3 GB on a GPU (half precision)",
    weights=EXPECTED,
    package=PACKAGE,
    install=INSTALL,
)
MAGICDRIVE_T = replace(
    MAGICDRIVE,
    name="magicdrive-t",
    make=partial(magicdrive, temporal=True),
    takes=MAGICDRIVE.takes - {"fps"},
    about="six cameras from a layout by MagicDrive-t, 16 time steps together",
    memory="about 13 GB on a CPU (float32), 7 GB on a GPU (half precision)",
)
