"""One scene of a data set: what the prior is asked for, and the real pictures."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast, get_args

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.input import dataset_of, log_of, read_dataset
from dreamdrive.datasets.logs import choose_shots
from dreamdrive.decompose import PerFrameOptions
from dreamdrive.errors import InputError
from dreamdrive.names import RepresentationName
from dreamdrive.options import Options
from dreamdrive.prior import choose_prior
from dreamdrive.run import Request, request_of
from dreamdrive.scene.control import Control

ALL = "all"
STANDING = "hybrid-standing"
"""Hybrid whose street always stands, as the paper's does; that of hybrid drifts where frames ask for it."""
ROWS: tuple[str, ...] = (*get_args(RepresentationName), STANDING)
"""What has a row in the table."""


@dataclass(frozen=True)
class Case:
    """A scene and how it is made.

    Attributes:
        recorded: Its pictures, as a replay takes them.
        prior: What makes the frames.
        weights: Of the prior, if it has a network.
        options: Of the fits, whatever the representation.
    """

    recorded: Control
    prior: str
    weights: str | None
    options: Options

    @property
    def name(self) -> str:
        """For files and messages."""
        return str(self.recorded.scene)

    def control(self) -> Control:
        """What the prior is asked for: the scene, or to go on from its first picture."""
        prior = choose_prior(self.prior)
        if "scene" in prior.takes:
            return self.recorded
        log = log_of(self.recorded)
        assert log is not None
        lead = choose_shots(log, self.recorded.cameras, self.recorded.frames)[0]
        pinhole = lead.camera.pinhole
        hfov_deg = float(np.rad2deg(2 * np.arctan2(pinhole.width_px / 2, pinhole.fx_px)))
        told = {"path": lead.camera.files[lead.rows[0]], "hfov_deg": hfov_deg}
        kept = {name: getattr(self.recorded, name) for name in ("size", "hold_out")}
        return Control(**{k: v for k, v in (told | kept).items() if k in prior.takes})

    def request(self, row: str) -> Request:
        """All that a scene follows from but the program."""
        if row == STANDING:
            options = replace(self.options, representation="hybrid", drift=PerFrameOptions(allowed=False))
        else:
            options = replace(self.options, representation=cast(RepresentationName, row))
        return request_of(self.control(), prior=self.prior, weights=self.weights, options=options)

    def real(self, size: tuple[int, int]) -> UInt8[np.ndarray, "f h w 3"]:
        """The recorded pictures of the first camera."""
        clip = read_dataset(replace(self.recorded, size=size, hold_out=None))
        return clip.frames[clip.of_camera(int(clip.camera[0]))]


def scene_names(path: Path, wanted: list[str]) -> list[str]:
    """Names of scenes by names or numbers, or of all."""
    if not path.exists():
        raise InputError(f"{path} does not exist; expected a data set with scenes")
    logs = dataset_of(None, path).logs
    if logs is None:
        raise InputError(f"{path} is a single recording; expected a data set with scenes, such as nuScenes")
    names = logs.names(path)
    if wanted == [ALL]:
        return list(names)
    found = [_name(each, names, path) for each in wanted]
    if len(set(found)) < len(found):
        raise InputError(f"--scenes {' '.join(wanted)}: a scene is named twice; expected each once")
    return found


def _name(wanted: str, names: tuple[str, ...], path: Path) -> str:
    if wanted in names:
        return wanted
    if wanted.isdecimal() and int(wanted) < len(names):
        return names[int(wanted)]
    raise InputError(
        f"--scenes {wanted}: {path} has no such scene; expected a name, a number from 0 to {len(names) - 1}, "
        f"or {ALL}"
    )
