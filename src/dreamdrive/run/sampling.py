"""Priors on their own: frames and features on disk, with where they come from, for ``replay`` to take up."""

import os
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from dreamdrive import __version__
from dreamdrive.data import read_clip
from dreamdrive.data.feature_file import INDEX, MAX_CHANNELS, FeatureFile, write_features
from dreamdrive.data.recording import write_recording
from dreamdrive.data.source import open_source
from dreamdrive.errors import InputError
from dreamdrive.files.digest import file_digest
from dreamdrive.files.given import check_there
from dreamdrive.files.kinds import RECORDING_KIND
from dreamdrive.files.output import check_free
from dreamdrive.models import find_weights
from dreamdrive.prior import Input, choice_of, choose_prior
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import FILES, Action, Control

_SEEN_PX = 1024


def sample(
    control: Control,
    out: Path,
    *,
    prior: str | None = None,
    weights: str | Path | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Clip:
    """Run a prior and write what it gives in the format of ``data.recording``, for ``replay`` to take up.

    Without a name the input decides on the prior, see ``prior.auto_prior``; weights as of
    ``hub.find_weights``. ``force`` replaces an older folder of this kind.
    """
    choice = choice_of(control, prior, weights is not None)
    name, weights = choice.name, choice.weights if weights is None else weights
    control = control if weights is None else replace(control, weights=find_weights(weights))
    choose_prior(name).check(control)
    for file in FILES:
        path: object = getattr(control, file)
        if isinstance(path, Path):
            check_there(path, f"the {file if file != 'path' else 'input'}")
    if control.path is not None and os.path.realpath(out) == os.path.realpath(control.path):
        raise InputError(f"{out} is the input itself; choose another output folder")
    check_free(out, force, RECORDING_KIND)
    opened = choose_prior(name).open(control)
    clip = opened.clip(progress)
    if clip.step[-1] < 1:
        raise InputError(f"--frames {control.frames}: a single frame is no recording; choose two or more")
    write_recording(clip, out, _about(opened), replace=force)
    return clip


def _about(opened: Input) -> dict[str, Any]:
    """What it takes to make the same again: files by name and content, all else by value."""
    control = opened.control
    given = {name: path for name in FILES if isinstance(path := getattr(control, name), Path)}
    known = {"path": opened.digest}
    return {
        "dreamdrive": __version__,
        "prior": opened.prior.name,
        "seed": control.seed,
        "options": {name: value for name, value in control.settings.items() if value is not None},
        "files": {name: _named(path, known.get(name)) for name, path in given.items()},
    }


def _named(path: Path, known: str | None = None) -> dict[str, str]:
    """A file or folder, with its digest unless that of what is used of it is known."""
    return {"name": path.name, "sha256": file_digest(path, deep=True) if known is None else known}


def detailed_size(path: Path) -> tuple[int, int]:
    """Width and height at which frames keep the detail that a network of ``_SEEN_PX`` columns sees."""
    width, height = next(iter(open_source(path).read(range(1)))).size
    shrink = min(1.0, _SEEN_PX / width)
    return 2 * round(shrink * width / 2), 2 * round(shrink * height / 2)


def clip_features(
    path: Path,
    out: Path,
    weights: str | Path,
    options: dict[str, Any],
    *,
    frames: str | None = None,
    size: tuple[int, int] | None = None,
    action: Action | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> FeatureFile:
    """Features of a recorded clip by the network of Vista or Stable Video Diffusion, written to a file.

    Options are fields of ``prior.vista.features.FeatureOptions``, weights as of ``hub.find_weights``;
    ``size`` is the one at which the network sees the frames, ``action`` what the car does, for Vista.
    """
    from dreamdrive.prior.vista.features import FeatureOptions, video_features

    if out.suffix != ".safetensors":
        raise InputError(f"-o {out}: expected a name that ends in .safetensors")
    chosen, folder = FeatureOptions(**options), find_weights(weights)
    if not (0 < chosen.sigma < float("inf") and 1 <= chosen.channels <= MAX_CHANNELS):
        raise InputError(
            f"--sigma {chosen.sigma:g} --channels {chosen.channels}: expected a deviation above 0 and "
            f"1 to {MAX_CHANNELS} channels"
        )
    clip = read_clip(path, frames=frames, size=detailed_size(path))
    found = video_features(
        clip.frames, folder, chosen, size=size, action=action, seed=seed, progress=progress
    )
    about = {
        "dreamdrive": __version__,
        "features": asdict(chosen),
        "clip": {"name": path.name, "sha256": file_digest(path)},
        "weights": _named(folder),
        INDEX: clip.source_index.tolist(),
        "action": None if action is None else asdict(action),
        "seed": seed,
        "notes": list(found.notes),
    }
    made = FeatureFile({found.name: found.values}, about)
    write_features(out, made)
    return made
