"""Clips made of a photo or a few leading frames. Importing this loads diffusers."""

from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from dreamdrive.compute.device import chosen_device
from dreamdrive.data.frames.select import Selection, held_out_mask
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.early_features import BLOCK
from dreamdrive.prior.path import STEERING_RATIO, asked_path, path_by_rounds, wanted_path, waypoints_by_round
from dreamdrive.prior.running import check_finite, counted, enough_memory
from dreamdrive.prior.vista.condition import columns_by_round, embed_action, numbers_of
from dreamdrive.prior.vista.engine import Engine
from dreamdrive.prior.vista.features import Window, extract
from dreamdrive.prior.vista.kinds import SVD, ModelKind
from dreamdrive.prior.vista.memory import Job, smaller_size
from dreamdrive.prior.vista.picture import NATIVE, Leading, check_size, read_leading, to_frames, to_images
from dreamdrive.prior.vista.rollout import SCALE, decode_in_chunks, roll_out, rounds_for
from dreamdrive.prior.vista.stored import notes_of, open_weights
from dreamdrive.progress import Progress
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Action, Control, Goal, Steering, Waypoints
from dreamdrive.scene.trajectory import Trajectory

_MOST_FRAMES = 1000


def make_clip(kind: ModelKind, control: Control, progress: Progress) -> Clip:
    """Generate the clip; Z_ref is ``features["appearance"]`` and the video model's own.

    The input is a photo, or a video or folder whose first frames are kept (up to three by Vista, one by SVD).
    ``control.frames`` counts the frames made: its STOP says how many rounds are needed. ``latents`` are the
    sampled ones, 0.18215 times those of the autoencoder.
    """
    if control.path is None or control.weights is None:
        raise InputError(f"the prior {kind.name} needs an input, a photo, and --weights")
    size, steps = control.size or NATIVE, control.steps or kind.steps
    check_size(size)
    leading = read_leading(
        control.path, max(kind.overlap, 1), kind.rate_hz, size, control.intrinsics, control.hfov_deg
    )
    engine = Engine(open_weights(control.weights, kind), chosen_device())
    count = engine.per_round
    wanted = _wanted(control.frames, kind, count)
    held_out = held_out_mask(len(wanted), control.hold_out)
    step = count - kind.overlap
    starts = range(0, step * rounds_for(int(wanted[-1]) + 1, kind, count), step)
    spans = [range(start, start + count) for start in starts]
    engine.check_fit(Job(size, spans[-1].stop, count))
    told, asked = _told(control, kind, spans, wanted / kind.rate_hz)
    noticed = notes_of(engine.stored)
    windows = [
        Window(span, columns, kind.overlap if number else min(len(leading.frames), kind.overlap))
        for number, (span, columns) in enumerate(zip(spans, told, strict=True))
    ]
    tell = counted(progress, len(spans) * steps + 1 + len(spans))
    smaller = "x".join(map(str, smaller_size(size)))
    with torch.inference_mode(), enough_memory(f"choose a smaller --size, such as {smaller}"):
        latents = _sample(engine, kind, leading, windows, steps, control.seed, tell).cpu()
        images = decode_in_chunks(engine.decode, latents / SCALE)
        check_finite(images, "frames")
        frames = to_frames(images)
        tell()
        features = extract(engine, latents, frames, windows, seed=control.seed, tell=tell)
    engine.free()
    frames, latents, features = frames[wanted], latents[torch.from_numpy(wanted)], features[wanted]
    valid = np.ones(frames.shape[:3], dtype=bool)
    return Clip(
        frames=frames,
        times_s=(wanted - wanted[0]) / kind.rate_hz,
        camera=np.zeros(len(wanted), dtype=np.int64),
        rig=(leading.calibration.camera,),
        valid=valid,
        held_out=held_out,
        source_index=wanted,
        features={"appearance": appearance(frames, valid), f"{kind.name}:{BLOCK}": features},
        latents=latents.permute(0, 2, 3, 1).contiguous().numpy(),
        known=Known(intrinsics=leading.calibration.known, hfov=leading.calibration.hfov),
        requested=asked,
        provenance=_provenance(kind, control, leading, steps, len(spans), noticed),
    )


def _wanted(frames: str | None, kind: ModelKind, per_round: int) -> Int[np.ndarray, " f"]:
    """Indices of the frames to keep, among all that are made."""
    selection = Selection.parse(frames)
    if selection.needs_count:
        raise InputError(f"--frames {frames}: count from the first frame; there is no last one")
    if selection.stop is None:
        selection = replace(selection, stop=max(per_round, selection.start + per_round))
    wanted = selection.resolve(None, "the generated clip")
    if kind.overlap == 0 and wanted[-1] >= per_round:
        raise InputError(
            f"--frames {frames}: {kind.title} makes {per_round} frames and cannot go on from them; give "
            f"a STOP of at most {per_round}, or use --prior vista"
        )
    if len(wanted) < 2 or wanted[-1] >= _MOST_FRAMES:
        raise InputError(
            f"--frames {frames} asks for {len(wanted)} frames up to number {wanted[-1]}; expected two or "
            f"more below {_MOST_FRAMES}"
        )
    return np.array(wanted, dtype=np.int64)


def _told(
    control: Control, kind: ModelKind, spans: list[range], times_s: Float[np.ndarray, " f"]
) -> tuple[list[Float[Tensor, " a"] | None], Trajectory | None]:
    """Columns of the action in each round, None for SVD; and the path that it asks for, if it does."""
    if kind is SVD:
        return [None] * len(spans), None
    path = wanted_path(control)
    if path is not None:
        starts_s = np.array([span.start for span in spans]) / kind.rate_hz
        points = waypoints_by_round(path, starts_s, float(times_s[-1]))
        return [embed_action(numbers_of(each)) for each in points], asked_path(path, times_s)
    path = None
    if isinstance(control.action, Waypoints | Steering):
        path = asked_path(path_by_rounds(control.action, spans, kind.rate_hz), times_s)
    return list(columns_by_round(control.action, len(spans))), path


def _sample(
    engine: Engine,
    kind: ModelKind,
    leading: Leading,
    windows: list[Window],
    steps: int,
    seed: int,
    tell: Callable[[], None],
) -> Float[Tensor, "f c h w"]:
    """Latents of all frames; noise is drawn on the CPU, so that it is the same everywhere."""
    draw = torch.Generator().manual_seed(seed)
    images = to_images(leading.frames)
    height, width = images.shape[2] // 8, images.shape[3] // 8
    channels = engine.stored.parts["unet"].config.get("out_channels", 4)
    shape = len(windows), len(windows[0].span), channels, height, width
    noise = torch.randn(shape, generator=draw)
    first = None
    if kind.noise > 0:
        first = images[:1] + kind.noise * torch.randn(images[:1].shape, generator=draw)
    actions = [window.action for window in windows]
    made = roll_out(engine, kind, images, noise.to(engine.device), actions, steps, first=first, tell=tell)
    check_finite(made, "latents")
    return made


def _provenance(
    kind: ModelKind, control: Control, leading: Leading, steps: int, rounds: int, noticed: list[str]
) -> dict[str, Any]:
    assert control.path is not None
    notes = [
        f"The frames are generated: {kind.title} made them of {control.path.name} in {rounds} "
        f"round{'s' if rounds > 1 else ''} of {steps} steps. They hold no geometry: camera poses, depth and "
        "scale are not known and have to be found in the frames.",
        *leading.notes,
        *noticed,
    ]
    if len(leading.frames) > 1:
        notes.append(f"The first {len(leading.frames)} frames of the input were kept as the first ones.")
    if control.action is not None:
        again = "in the first round alone" if isinstance(control.action, Goal) else "anew in every round"
        notes.append(
            "The action was asked for"
            + (f", {again}" if rounds > 1 else "")
            + "; how well the frames follow it is not known."
        )
    if isinstance(control.action, Steering):
        notes.append(
            "The path that speed and wheel ask for is that of a bicycle model; its steering ratio of "
            f"{STEERING_RATIO:g} is assumed."
        )
    if control.trajectory is not None:
        notes.append(
            "A path was asked for, as four waypoints in each round; how well the frames follow it is for the "
            "geometry to find."
        )
    return {
        "prior": kind.name,
        "model": kind.title,
        "weights": str(control.weights),
        "input": str(control.path),
        "steps": steps,
        "seed": control.seed,
        "rounds": rounds,
        "size": list(control.size or NATIVE),
        "action": None if control.action is None else _named(control.action),
        "crop_offset": list(leading.framing.corner),
        "crop_size": list(leading.framing.part),
        "notes": notes,
    }


def _named(action: Action) -> dict[str, Any]:
    values = {name: list(v) if isinstance(v, tuple) else v for name, v in asdict(action).items()}
    return {"kind": type(action).__name__.lower(), **values}
