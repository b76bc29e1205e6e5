"""Priors on their own: frames and features on disk, with where they come from, for ``replay`` to take up."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from dreamdrive import __version__
from dreamdrive.data import read_clip
from dreamdrive.data.feature_file import INDEX, MAX_CHANNELS, FeatureFile, write_features
from dreamdrive.data.recording import KIND, write_recording
from dreamdrive.data.source import open_source
from dreamdrive.errors import InputError
from dreamdrive.files.output import check_free
from dreamdrive.models import find_weights
from dreamdrive.prior import Choice, auto_prior, choose_prior
from dreamdrive.progress import Progress, silent
from dreamdrive.run.request import digest_of_log
from dreamdrive.run.stages import file_digest
from dreamdrive.scene.action import Action
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import FILES, Control

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
    choice = Choice(prior, "named") if prior else auto_prior(control.path, weights is not None)
    name, weights = choice.name, choice.weights if weights is None else weights
    control = control if weights is None else replace(control, weights=find_weights(weights))
    chosen = choose_prior(name)
    chosen.check(control)
    for file in FILES:
        path: object = getattr(control, file)
        if isinstance(path, Path) and not path.exists():
            raise InputError(f"{path} does not exist; expected the {file if file != 'path' else 'input'}")
    if control.path is not None and out.resolve() == control.path.resolve():
        raise InputError(f"{out} is the input itself; choose another output folder")
    check_free(out, force, KIND)
    clip = chosen(control, progress)
    if clip.step[-1] < 1:
        raise InputError(f"--frames {control.frames}: a single frame is no recording; choose two or more")
    write_recording(clip, out, _about(name, control), replace=force)
    return clip


def _about(prior: str, control: Control) -> dict[str, Any]:
    """What it takes to make the same again: files by name and content, all else by value."""
    given = {name: path for name in FILES if isinstance(path := getattr(control, name), Path)}
    drive = digest_of_log(control, prior)
    return {
        "dreamdrive": __version__,
        "prior": prior,
        "seed": control.seed,
        "options": {name: value for name, value in control.settings.items() if value is not None},
        "files": {name: _named(path, drive if name == "path" else None) for name, path in given.items()},
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
