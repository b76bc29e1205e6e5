"""Loading of diffusers' pipelines, and clips of the videos that they make."""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int

from dreamdrive.compute.device import chosen_device
from dreamdrive.data.frames.select import Selection, held_out_mask
from dreamdrive.data.photo import Photo, read_photo
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.running import check_finite, enough_memory, first_line
from dreamdrive.progress import Progress
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Control
from dreamdrive.scene.trajectory import Trajectory

PROMPT = "The view ahead from a car that drives along a street."
"""What pipelines that take words are told unless the user says it."""


def class_name(folder: Path) -> str:
    """The class of the pipeline in a folder."""
    index = folder / "model_index.json"
    if not index.is_file():
        raise InputError(
            f"--weights {folder}: expected the folder of a diffusers pipeline, with {index.name}"
        )
    name = read_json(index, "--weights").get("_class_name")
    if not isinstance(name, str):
        raise InputError(f"--weights {index} names no class of diffusers, but {name!r}")
    return name


def load(kind: Any, folder: Path, **options: Any) -> Any:
    """A pipeline from its folder, on the GPU where there is one; nothing is downloaded or unpickled.

    ``options`` are further arguments of ``from_pretrained``.
    """
    gpu = chosen_device().type == "cuda"
    try:
        pipeline = kind.from_pretrained(
            folder,
            torch_dtype=torch.bfloat16 if gpu else torch.float32,
            local_files_only=True,
            use_safetensors=True,
            **options,
        )
    except (OSError, ValueError, TypeError, KeyError, AttributeError, ImportError, RuntimeError) as error:
        raise InputError(
            f"--weights {folder} cannot be loaded as {kind.__name__}: {first_line(error)}; expected all its "
            "parts with weights as .safetensors"
        ) from error
    pipeline.set_progress_bar_config(disable=True)
    if gpu:
        pipeline.enable_model_cpu_offload()
    return pipeline


def run(pipeline: Any, steps: int, progress: Progress, *, seed: int, **arguments: Any) -> Any:
    """What a pipeline returns; its noise is drawn on the CPU, so that a seed is the same everywhere."""

    def tell(_: object, step: int, __: object, values: dict[str, Any]) -> dict[str, Any]:
        progress(step + 1, steps)
        return values

    try:
        with enough_memory("choose a smaller --size or fewer --frames"):
            return pipeline(
                num_inference_steps=steps,
                generator=torch.Generator("cpu").manual_seed(seed),
                callback_on_step_end=tell,
                output_type="np",
                **arguments,
            )
    except ValueError as error:
        name = type(pipeline).__name__
        raise InputError(f"{name} refuses what it was asked for: {first_line(error)}") from error


def photo_of(control: Control, size: tuple[int, int], prior: str) -> Photo:
    """The picture that the video starts from."""
    if control.path is None:
        raise InputError(f"the prior {prior} needs an input: a photo, or a recording for its first frame")
    return read_photo(control.path, size, control.intrinsics, control.hfov_deg, control.view)


def wanted_frames(control: Control, usual: int) -> tuple[int, Int[np.ndarray, " f"]]:
    """How many frames to make, ``usual`` unless told, and which to keep; before anything is loaded."""
    selection = Selection.parse(control.frames)
    count = usual if selection.stop is None or selection.stop <= 0 else selection.stop
    index = np.array(selection.resolve(count, "the video to be made"))
    if len(index) < 2:
        raise InputError(f"--frames {control.frames} selects a single frame; expected two or more")
    held_out_mask(len(index), control.hold_out)
    return count, index


def make_clip(
    control: Control,
    wanted: tuple[int, Int[np.ndarray, " f"]],
    photo: Photo,
    video: Float[np.ndarray, "t h w 3"],
    rate_hz: float,
    provenance: dict[str, Any],
    asked: Trajectory | None = None,
) -> Clip:
    """The clip of a video, RGB in [0, 1], that a model made from a photo, its frame 0.

    ``wanted`` is what ``wanted_frames`` gave; some models make fewer, as a whole number of latents. ``asked``
    is the path that was asked for, one pose a frame of the video.
    """
    check_finite(video, "frames")
    count, kept = wanted
    index = kept[kept < len(video)]
    notes = [*photo.notes, *provenance["notes"]]
    made = f"the model made {len(video)} frames instead of {count}"
    if len(index) < len(kept):
        notes.append(f"{made.capitalize()}; the others are missing.")
    if len(index) < 2:
        raise InputError(f"--frames {control.frames}: {made}, and {len(index)} of those that were asked for")
    frames = np.rint(np.clip(video[index], 0, 1) * 255).astype(np.uint8)
    height, width = frames.shape[1:3]
    times_s = (index - index[0]) / rate_hz
    valid = np.ones(frames.shape[:3], dtype=bool)
    same = (width, height) == (photo.camera.width_px, photo.camera.height_px)
    requested = None
    if asked is not None:
        poses = asked.world_from_camera[index]
        requested = Trajectory(np.linalg.inv(poses[0]) @ poses, times_s)
    return Clip(
        frames=frames,
        times_s=times_s,
        camera=np.zeros(len(index), dtype=np.int64),
        rig=(photo.camera.resized(width, height),),
        valid=valid,
        held_out=held_out_mask(len(index), control.hold_out),
        source_index=index,
        features={"appearance": appearance(frames, valid)},
        known=Known(intrinsics=photo.calibrated and same, hfov=photo.hfov and same),
        requested=requested,
        provenance={**provenance, "notes": notes},
    )
