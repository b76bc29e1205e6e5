"""A photo, or a few leading frames, becomes a clip. Importing this loads diffusers."""

from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from dreamdrive.data import read_trajectory
from dreamdrive.data.select import Selection, held_out_mask
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.protocol import Progress
from dreamdrive.prior.vista.condition import embed_action, numbers_of
from dreamdrive.prior.vista.decode import decode_in_chunks
from dreamdrive.prior.vista.engine import Engine, counted
from dreamdrive.prior.vista.features import BLOCK, extract, windows
from dreamdrive.prior.vista.kinds import Kind
from dreamdrive.prior.vista.load import start
from dreamdrive.prior.vista.memory import Plan
from dreamdrive.prior.vista.path import asked_path, waypoints_by_round
from dreamdrive.prior.vista.picture import NATIVE, Leading, check_size, read_leading, to_frames
from dreamdrive.prior.vista.rollout import SCALE, roll_out, rounds_for
from dreamdrive.scene.action import Action, Goal
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Control
from dreamdrive.scene.trajectory import Trajectory

_MOST_FRAMES = 1000


def make_clip(kind: Kind, control: Control, progress: Progress) -> Clip:
    """Generate the clip; Z_ref is ``features["appearance"]`` and the video model's own.

    ``latents`` are the sampled ones, 0.18215 times those of the autoencoder.

    Args:
        kind: Which model.
        control: ``path`` is a photo, or a video or folder whose first frames are kept (up to three by Vista,
            one by SVD). ``frames`` counts the frames made: its STOP says how many rounds are needed.
        progress: Told of every step of the sampler, of decoding and of every window of features.

    Raises:
        InputError: The input, an option or the weights cannot be used, or memory does not suffice.
    """
    path, weights, steps = control.path, control.weights, control.steps or kind.steps
    size = control.size or NATIVE
    if path is None or weights is None:
        raise InputError(f"the prior {kind.name} needs an input, a photo, and --weights")
    check_size(size)
    leading = read_leading(
        path, max(kind.overlap, 1), kind.rate_hz, size, control.intrinsics, control.hfov_deg
    )
    networks, plan, per_round = start(weights, kind, size, _stop(control.frames))
    wanted = _wanted(control.frames, kind, per_round)
    held_out = held_out_mask(len(wanted), control.hold_out)
    rounds = rounds_for(int(wanted[-1]) + 1, kind, per_round)
    made = per_round + (rounds - 1) * (per_round - kind.overlap)
    path_asked = None if control.trajectory is None else read_trajectory(control.trajectory)
    engine, actions = (
        Engine(networks),
        _actions(control, path_asked, kind, rounds, per_round, int(wanted[-1])),
    )
    tell = counted(progress, rounds * steps + 1 + len(windows(made, per_round)))
    with torch.inference_mode():
        latents = _sample(engine, kind, leading, actions, steps, rounds, per_round, plan, control.seed, tell)
        images = decode_in_chunks(engine.decode, latents / SCALE, plan.chunk)
        frames, latents = to_frames(images), latents.cpu()
        tell()
        features = extract(
            engine,
            latents,
            frames,
            per_round,
            action=actions[0],
            seed=control.seed,
            progress=lambda done, total: tell(),
        )
    networks.free()
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
        known=Known(intrinsics=leading.calibration.known),
        requested=None if path_asked is None else asked_path(path_asked, wanted / kind.rate_hz),
        provenance=_provenance(kind, control, leading, steps, rounds, plan),
    )


def _stop(frames: str | None) -> int | None:
    """Frames that are made, as far as the selection alone tells."""
    stop = Selection.parse(frames).stop
    return None if stop is None else min(stop, _MOST_FRAMES)


def _wanted(frames: str | None, kind: Kind, per_round: int) -> Int[np.ndarray, " f"]:
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


def _actions(
    control: Control, path: Trajectory | None, kind: Kind, rounds: int, per_round: int, last: int
) -> list[Float[Tensor, " a"] | None]:
    """Columns of the action in each round; None for SVD, which has none."""
    if kind.overlap == 0:
        return [None] * rounds
    if path is not None:
        starts_s = np.arange(rounds) * (per_round - kind.overlap) / kind.rate_hz
        asked = waypoints_by_round(path, starts_s, last / kind.rate_hz)
        return [embed_action(numbers_of(action)) for action in asked]
    free = embed_action({})
    if control.action is None:
        return [free] * rounds
    given = embed_action(numbers_of(control.action))
    # A goal is a point of the first frame, which later rounds no longer see.
    return [given, *[free if isinstance(control.action, Goal) else given] * (rounds - 1)]


def _sample(
    engine: Engine,
    kind: Kind,
    leading: Leading,
    actions: list[Float[Tensor, " a"] | None],
    steps: int,
    rounds: int,
    per_round: int,
    plan: Plan,
    seed: int,
    tell: Callable[[], None],
) -> Float[Tensor, "f c h w"]:
    """Latents of all frames; noise is drawn on the CPU, so that it is the same everywhere."""
    draw = torch.Generator().manual_seed(seed)
    images = leading.images()
    height, width = images.shape[2] // 8, images.shape[3] // 8
    channels = engine.networks.stored.parts["unet"].config.get("out_channels", 4)
    noise = torch.randn((rounds, per_round, channels, height, width), generator=draw)
    first = None
    if kind.noise > 0:
        first = images[:1] + kind.noise * torch.randn(images[:1].shape, generator=draw)
    return roll_out(
        engine.model(),
        kind,
        images,
        noise.to(engine.networks.device),
        actions,
        steps,
        first=first,
        chunk=plan.chunk,
        tell=tell,
    )


def _provenance(
    kind: Kind, control: Control, leading: Leading, steps: int, rounds: int, plan: Plan
) -> dict[str, Any]:
    assert control.path is not None
    notes = [
        f"The frames are generated: {kind.title} made them of {control.path.name} in {rounds} "
        f"round{'s' if rounds > 1 else ''} of {steps} steps. They hold no geometry: camera poses, depth and "
        "scale are not known and have to be found in the frames.",
        *leading.notes,
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
        "decoded_at_once": plan.chunk,
        "crop_offset": list(leading.framing.corner),
        "crop_size": list(leading.framing.part),
        "lens": None,
        "notes": notes,
    }


def _named(action: Action) -> dict[str, Any]:
    values = {name: list(v) if isinstance(v, tuple) else v for name, v in asdict(action).items()}
    return {"kind": type(action).__name__.lower(), **values}
