"""Pairs of a render and what is truly to be seen there, of drawn streets and of recorded drives.

Of a drawn street of the second edition a scene is made, and seen from places aside whose truth is drawn. Of a
recorded drive scenes are made of every second, fourth and eighth frame, and seen at the frames between: their
errors are those that views aside have.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from dreamdrive.build import build_scene
from dreamdrive.data.clip_reader import read_clip
from dreamdrive.errors import InputError
from dreamdrive.options import QUALITIES
from dreamdrive.prior import appearance
from dreamdrive.restore import CHANNELS, Recordings
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.street.truth import DriveTruth, Semantic
from dreamdrive_train.pairs import CROP_PX, PlaneRange, Source
from streetworld import make_street
from streetworld.corruption import corrupt, parse_corruption

RANGE = PlaneRange((0.0,) * CHANNELS, (1.0,) * CHANNELS)
FIRST_SEED = 1_250_000
"""Of the drawn streets: none of these is judged by."""
THINNED = (2, 4, 8)
"""Of recorded drives every so many frames make a scene."""
_CLOSE_M, _MOST_CLOSE = 1.0, 0.3
"""A view with more than such a share of it so close looks out of something."""
_CORRUPTED = 0.25


@dataclass(frozen=True)
class RestorerPairs:
    """From where scenes are looked at.

    Attributes:
        each: Pairs a scene.
        aside_m: Largest distance to either side of the recorded drive.
        down_m: Least and largest distance downwards; above is negative.
        turned_rad: Standard deviation of the angle.
        frames: Of a drawn street, at 10 Hz.
        hold_out: Every how many of them one is withheld.
        sizes: Of drawn pictures; one of them is taken.
    """

    each: int = 16
    aside_m: float = 3.5
    down_m: tuple[float, float] = (-0.8, 0.4)
    turned_rad: float = 0.07
    frames: int = 16
    hold_out: int = 8
    sizes: tuple[tuple[int, int], ...] = ((320, 192), (320, 192), (384, 216))


def restorer_pairs(
    drives: Sequence[Path], seeds: Sequence[int], knowledge: str, options: RestorerPairs = RestorerPairs()
) -> dict[str, Source]:
    """The sources of pairs by their names: recorded drives, each thinned in several ways, and drawn streets.

    Drives of which no scene can be made give no pairs.
    """
    ways = {f"{path.parent.name}-{path.name}-{every}": (path, every) for path in drives for every in THINNED}
    return {
        name: partial(drive_pairs, path=path, every=every, knowledge=knowledge, options=options)
        for name, (path, every) in ways.items()
    } | {
        f"street-{seed}": partial(street_pairs, seed=seed, knowledge=knowledge, options=options)
        for seed in seeds
    }


def street_pairs(
    generator: np.random.Generator, seed: int, knowledge: str, options: RestorerPairs
) -> Iterator[UInt8[np.ndarray, "20 h w"]]:
    """Pairs of one drawn street; a quarter of them are made of frames that are corrupted as by a prior."""
    size = options.sizes[int(generator.integers(len(options.sizes)))]
    made = make_street(seed, options.frames, 10.0, size, edition=2)
    frames = made.frames
    if generator.random() < _CORRUPTED:
        frames = corrupt(frames, parse_corruption("generated", seed), made.depth_m)
    built = build_scene(_drawn(made, frames, options), replace(QUALITIES["draft"], knowledge=knowledge))
    recordings = Recordings.fitted(built.scene, built.clip.frames)
    for _ in range(options.each):
        frame = int(generator.integers(options.frames))
        camera = _aside(made.cameras[frame], options, generator)
        view = made.views([camera], [float(made.times_s[frame])])[0]
        near = (view.depth_m > 0) & (view.depth_m < _CLOSE_M)
        if near.mean() > _MOST_CLOSE:
            continue
        besides = frame if generator.random() < 0.3 else None
        _, told = recordings.told(camera, float(made.times_s[frame]), besides)
        yield RANGE.packed(told, view.frame, view.semantic != Semantic.OWN_CAR)


def drive_pairs(
    generator: np.random.Generator,
    path: Path,
    every: int,
    knowledge: str,
    options: RestorerPairs,
) -> Iterator[UInt8[np.ndarray, "20 h w"]]:
    """Pairs of a recorded drive, of whose frames every so many make the scene."""
    clip = read_clip(path)
    if min(clip.size) < CROP_PX:
        width, height = clip.size
        raise InputError(
            f"{path} is {width}x{height}; expected {CROP_PX} pixels on either side, to learn from"
        )
    held_out = np.arange(len(clip)) % every != 0
    if (~held_out).sum() < 2:
        raise InputError(f"{path} has {len(clip)} frames; expected more than {every}, for a scene of two")
    clip = replace(clip, held_out=held_out)
    clip = clip.with_features(appearance=appearance(clip.frames, clip.valid))
    built = build_scene(clip, replace(QUALITIES["draft"], knowledge=knowledge))
    recordings = Recordings.fitted(built.scene, built.clip.frames)
    views, street = np.flatnonzero(held_out), built.geometry.fixed_regions[0] == 0
    for view in generator.permutation(views)[: options.each].tolist():
        _, told = recordings.told(built.scene.cameras[view], float(clip.times_s[view]))
        counts = clip.valid[view] & street
        even = tuple(slice(0, side // 2 * 2) for side in counts.shape)
        yield RANGE.packed(told[:, *even], clip.frames[view][even], counts[even])


def _drawn(made: DriveTruth, frames: UInt8[np.ndarray, "f h w 3"], options: RestorerPairs) -> Clip:
    count, height, width = frames.shape[:3]
    clip = Clip(
        frames=frames,
        times_s=made.times_s,
        camera=np.zeros(count, dtype=np.int64),
        rig=(made.cameras[0].at(np.eye(4)),),
        valid=np.ones((count, height, width), dtype=bool),
        held_out=np.arange(count) % options.hold_out == options.hold_out - 1,
        source_index=np.arange(count),
        known=Known(made.trajectory.world_from_camera, intrinsics=True),
    )
    return clip.with_features(appearance=appearance(clip.frames, clip.valid))


def _aside(camera: Camera, options: RestorerPairs, generator: np.random.Generator) -> Camera:
    """A view from beside the recorded one, a little turned."""
    right_m = float(generator.uniform(-options.aside_m, options.aside_m))
    moved = camera.moved(
        right_m, float(generator.uniform(*options.down_m)), float(generator.uniform(-0.5, 0.5))
    )
    turn = generator.normal(0, options.turned_rad)
    pose = moved.world_from_camera.copy()
    pose[:3, :3] @= np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    return moved.at(pose)
