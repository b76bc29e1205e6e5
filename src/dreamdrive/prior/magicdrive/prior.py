"""The priors ``magicdrive`` and ``magicdrive-t``: six cameras of a street (Gao et al., ICLR 2024)."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.frames.select import Selection, held_out_mask
from dreamdrive.datasets.logs import ALL
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.early_features import BLOCK
from dreamdrive.prior.magicdrive.cameras import NUSCENES
from dreamdrive.prior.magicdrive.condition import OfLayout, StreetCondition, check_map, prompt_of
from dreamdrive.prior.magicdrive.config import EXPECTED
from dreamdrive.prior.magicdrive.of_scene import OfScene, of_street
from dreamdrive.prior.protocol import Input, Prior
from dreamdrive.prior.running import INSTALL, PACKAGE, enough_memory
from dreamdrive.prior.street import StreetSource, read_street, wanted_frames
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Control, StreetInput, fields_of
from dreamdrive.scene.geometry import Scale
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


def magicdrive(opened: Input, progress: Progress = silent, *, temporal: bool = False) -> Clip:
    """Six pictures of every time step, each of them sampled by itself, or all together.

    Always sampled together is the whole length of the weights, at 12 Hz from time 0 of the street. Z_ref is
    ``features["appearance"]`` and what the UNet sees in the pictures.
    """
    control = opened.control
    street, weights = _inputs(opened)
    seen = OfLayout(street.layout) if street.log is None else of_street(street)
    rate_hz = RATE_HZ if control.fps is None else control.fps
    wanted = None if temporal else _time_steps(control, street, rate_hz, None)
    try:
        from dreamdrive.prior.magicdrive.folder import read_parts
        from dreamdrive.prior.magicdrive.sample import SampleRun, generate
    except ImportError as error:
        raise InputError(f"the prior magicdrive cannot start ({error}): {INSTALL}") from None
    with enough_memory("take the weights for 400x224, which need least, or a GPU with more memory"):
        parts = read_parts(weights, temporal=temporal)
        if wanted is None:
            wanted = _time_steps(control, street, rate_hz, parts.settings.frames)
        steps = STEPS if control.steps is None else control.steps
        prompt = seen.prompt(control.prompt) if isinstance(seen, OfScene) else prompt_of(control.prompt)
        run = SampleRun(seen, parts, prompt, steps, control.seed, rate_hz)
        made = generate(run, wanted, progress)
    name = MAGICDRIVE_T.name if temporal else MAGICDRIVE.name
    valid = np.ones(made.frames.shape[:3], dtype=bool)
    own = seen.notes if isinstance(seen, OfScene) else (_TYPICAL.format(ego=street.layout.ego),)
    notes = [*_notes(name, street, temporal), *own, *made.notes]
    about = {"prior": name, "cameras": list(seen.ring.names), "notes": notes}
    return Clip(
        frames=made.frames,
        valid=valid,
        held_out=np.repeat(held_out_mask(len(wanted), control.hold_out), CAMERAS),
        latents=made.latents,
        source_index=np.repeat(wanted, CAMERAS),
        features={"appearance": appearance(made.frames, valid), f"{name}:{BLOCK}": made.features},
        log=seen.place_in_log(float(wanted[0] / rate_hz)) if isinstance(seen, OfScene) else None,
        provenance=about | run.about(),
        **_cameras(seen, wanted / rate_hz, parts.settings.size, temporal),
    )


def _time_steps(
    control: Control, street: StreetSource, rate_hz: float, count: int | None
) -> Int[np.ndarray, " t"]:
    """The time steps to make, of as many as there are, if that is given by the weights."""
    if count is None:
        wanted = wanted_frames(control, TIME_STEPS, rate_hz, street)
    else:
        wanted = Selection.parse(control.frames).resolve(count, "the clip of these weights")
        there = street.count(rate_hz)
        if there is not None and there < count:
            raise InputError(
                f"{street.name} is labelled for {there} time steps at {rate_hz:g} Hz, and these weights make "
                f"{count} together; choose a longer scene, or take --prior magicdrive"
            )
    held_out_mask(len(wanted), control.hold_out)  # complains before anything is loaded or made
    return np.array(wanted)


def _inputs(opened: Input) -> tuple[StreetSource, Path]:
    """The street and the folder of weights."""
    control = opened.control
    if control.weights is None:
        raise InputError(f"the prior magicdrive needs --weights, {EXPECTED}")
    if control.steps is not None and control.steps > MOST_STEPS:
        raise InputError(f"--steps {control.steps}: expected at most {MOST_STEPS}, such as {STEPS}")
    if control.path is None:
        raise InputError(
            "the prior magicdrive needs a layout: a JSON, see docs/layout.md; dreamdrive world make draws "
            "one. Or a folder of a data set with six cameras and a map"
        )
    street = read_street(opened, control.path, without=ALL)
    if street.log is None:
        check_map(street.layout, str(control.path))
    return street, control.weights


def _cameras(
    seen: StreetCondition, times_s: Float[np.ndarray, " t"], size: tuple[int, int], temporal: bool
) -> dict[str, Any]:
    """Times, rig and the path by time, then camera; the world is the front camera of the first time step.

    Time steps that were sampled together may show how the cameras move, which is for the geometry to find.
    Those that were sampled one by one cannot: their poses are taken as asked for.
    """
    pinholes = seen.ring.rig(size)
    front = seen.world_from_car(times_s) @ seen.ring.car_from_camera[0]
    world_from_front = np.linalg.inv(front[0]) @ front
    world_from_front[0] = np.eye(4)
    mounted = np.stack([camera.world_from_camera for camera in pinholes])
    poses = None if temporal else (world_from_front[:, None] @ mounted).reshape(-1, 4, 4)
    since_s = times_s - times_s[0]
    return {
        "times_s": np.repeat(since_s, CAMERAS),
        "camera": np.tile(np.arange(CAMERAS), len(times_s)),
        "rig": pinholes,
        "known": Known(
            poses, intrinsics=True, generated=True, scale=Scale("the path asked for", 0.0, basis="asked path")
        ),
        "requested": Trajectory(world_from_front, since_s),
    }


def _notes(name: str, street: StreetSource, temporal: bool) -> list[str]:
    return [
        f"The frames are generated from {street.name} by {name}, six cameras at each time step, for "
        "intrinsics, mountings and a path that a generated picture follows only roughly.",
        _TOGETHER if temporal else _ALONE,
    ]


_TYPICAL = (
    f"The cameras are typical ones of nuScenes, the front one {NUSCENES[0].place_m[2]:g} m high; the "
    "layout's camera height of {ego.camera_height_m:g} m and its shaking are not followed."
)
_TOGETHER = (
    "All time steps were sampled together; frames agree in time as far as the network learned it. The path "
    "is looked for in them, and the report compares it with the one asked for."
)
_ALONE = (
    "Each time step was sampled by itself, from the same noise: beyond map, boxes and noise nothing ties one "
    "to the next, and what these leave open (houses, colours, sky) changes from step to step. No "
    "motion can be seen in such frames: the poses are those that they were asked for."
)

MAGICDRIVE = Prior(
    name="magicdrive",
    make=magicdrive,
    takes=fields_of(StreetInput) - {"size"} | {"prompt", "steps"},
    of_street=True,
    gives="six cameras at each time step, the intrinsics, mountings and path asked for, latents, features",
    about="six cameras from a layout or a scene of a data set by MagicDrive, each time step by itself",
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
    about="six cameras from a layout or a scene of a data set by MagicDrive-t, 16 time steps together",
    memory="about 13 GB on a CPU (float32), 7 GB on a GPU (half precision)",
)
