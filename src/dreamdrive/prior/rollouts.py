"""Several drives from one first frame: each made by itself, together as the cameras of one rig."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from dreamdrive.data import read_trajectories
from dreamdrive.data.frames.select import Selection
from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.gaussians import Gaussians


def rollouts_of(control: Control) -> list[Control]:
    """A control for each drive that is asked for, in their order."""
    if control.trajectories is not None:
        paths = read_trajectories(control.trajectories)
        several = [replace(control, trajectories=None, trajectory=path) for path in paths]
    elif control.actions:
        several = [replace(control, actions=None, action=action) for action in control.actions]
    else:
        return [control]
    if len(several) > 1 and Selection.parse(control.frames).start != 0:
        raise InputError(
            f"--frames {control.frames}: several drives have the first frame in common; start at 0"
        )
    return several


def together(clips: Sequence[Clip]) -> Clip:
    """Clips of the same times and first frame as one, in which each is a camera of its own."""
    first = clips[0]
    if len(clips) == 1:
        return first
    camera = np.repeat(np.arange(len(clips)), len(first))
    order = np.lexsort((camera, np.concatenate([clip.times_s for clip in clips])))

    def woven(of: Callable[[Clip], Any]) -> Any:
        values = [of(clip) for clip in clips]
        return None if any(each is None for each in values) else np.concatenate(values)[order]

    def feature(name: str) -> Any:
        return woven(lambda clip: clip.features[name])

    names = set.intersection(*(set(clip.features) for clip in clips))
    unseen = [clip.known.unseen for clip in clips if clip.known.unseen is not None]
    known = replace(
        first.known,
        world_from_camera=woven(lambda clip: clip.known.world_from_camera),
        depth_m=woven(lambda clip: clip.known.depth_m),
        sky=woven(lambda clip: clip.known.sky),
        unseen=_in_all(unseen) if len(unseen) == len(clips) else None,
        shared_first=True,
    )
    notes = [
        f"{len(clips)} drives begin at the same first frame; each is a camera of its own.",
        *dict.fromkeys(note for clip in clips for note in clip.provenance.get("notes", [])),
    ]
    return replace(
        first,
        frames=woven(lambda clip: clip.frames),
        times_s=woven(lambda clip: clip.times_s),
        camera=camera[order],
        rig=tuple(clip.rig[0] for clip in clips),
        valid=woven(lambda clip: clip.valid),
        held_out=woven(lambda clip: clip.held_out),
        source_index=woven(lambda clip: clip.source_index),
        features={name: feature(name) for name in sorted(names)},
        latents=woven(lambda clip: clip.latents),
        known=known,
        set_in_motion=woven(lambda clip: clip.set_in_motion),
        provenance={**first.provenance, "notes": notes},
    )


def _in_all(parts: Sequence[Gaussians]) -> Gaussians:
    """Gaussians that are in all of several selections of the same ones, in the order of the first."""
    rows = [np.ascontiguousarray(part.means.numpy()).view(np.dtype((np.void, 12))).ravel() for part in parts]
    kept = np.ones(len(rows[0]), bool)
    for other in rows[1:]:
        kept &= np.isin(rows[0], other)
    return parts[0].select(torch.from_numpy(np.flatnonzero(kept)))
