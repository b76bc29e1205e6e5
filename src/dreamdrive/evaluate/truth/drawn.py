"""The truth of a simulated world about the frames of a scene."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.data.truth_folder import read_world
from dreamdrive.errors import InputError
from dreamdrive.files.given import WORLD, check_there
from dreamdrive.prior import DRAWS_LAYOUTS, choose_prior
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.truth import DriveTruth, WorldBox


@dataclass(frozen=True)
class Truth:
    """Exact masks and depth of F frames, in metres, in a world of their own.

    Attributes:
        cameras: One posed pinhole a frame.
        depth_m: Depth along z (F, H, W); 0 in the sky.
        instance: Label of the road user in each pixel (F, H, W), 0 for none.
        moving: Pixels of road users that move (F, H, W).
        boxes: Hulls of the road users, with a pose a frame; may be left out.
    """

    cameras: tuple[Camera, ...]
    depth_m: Float[np.ndarray, "f h w"]
    instance: Int[np.ndarray, "f h w"]
    moving: Bool[np.ndarray, "f h w"]
    boxes: tuple[WorldBox, ...] = ()

    def __post_init__(self) -> None:
        shape = len(self.cameras), self.cameras[0].height_px, self.cameras[0].width_px
        for name in ("depth_m", "instance", "moving"):
            if getattr(self, name).shape != shape:
                raise ValueError(f"truth: {name} of shape {getattr(self, name).shape}, expected {shape}")

    @staticmethod
    def of(drive: DriveTruth, index: Sequence[int] | None = None) -> "Truth":
        """The truth of a drive, or of some of its frames."""
        rows = np.arange(len(drive.cameras)) if index is None else np.asarray(index, dtype=np.int64)
        cameras = tuple(drive.cameras[i] for i in rows.tolist())
        boxes = tuple(replace(box, world_from_box=box.world_from_box[rows]) for box in drive.boxes)
        return Truth(cameras, drive.depth_m[rows], drive.instance[rows], drive.moving[rows], boxes)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.moving.shape[2], self.moving.shape[1]

    def points_m(self, frame: int, mask: Bool[np.ndarray, "h w"]) -> Float[np.ndarray, "n 3"]:
        """The surface in the pixels of a mask, in the world of the truth."""
        camera = self.cameras[frame]
        local = camera.rays()[mask] * self.depth_m[frame][mask][:, None]
        return local @ camera.world_from_camera[:3, :3].T + camera.world_from_camera[:3, 3]


def read_truth(scene: Scene, world: Path) -> Truth:
    """The truth of a scene's frames, by a world folder or by a layout, which is drawn again.

    Raises:
        InputError: There is neither, it is damaged, or it has fewer frames.
    """
    check_there(world, WORLD)
    index = np.array(scene.provenance.source_index or range(len(scene.cameras)), dtype=np.int64)
    if world.is_dir():
        made = read_world(world)
    else:
        size = (scene.cameras[0].width_px, scene.cameras[0].height_px)
        made = drawn_again(world, index, scene.times_s, size)
    if index.max() >= len(made.frames):
        raise InputError(
            f"{world} has {len(made.frames)} frames but the scene shows frame {index.max()}; "
            "give the world that the scene was made from"
        )
    return Truth.of(made, index.tolist())


def drawn_again(
    layout: Path, index: Int[np.ndarray, " f"], times_s: Float[np.ndarray, " f"], size: tuple[int, int]
) -> DriveTruth:
    """The truth of a layout by the prior that draws it."""
    truth = choose_prior(DRAWS_LAYOUTS).truth
    assert truth is not None
    return truth(layout, index, times_s, size)


def views_of(scene: Scene, truth: Truth) -> tuple[Camera, ...]:
    """The scene's own cameras with the pixels of the truth."""
    if len(scene.cameras) != len(truth.cameras):
        raise InputError(
            f"the scene has {len(scene.cameras)} frames but the truth has {len(truth.cameras)}; "
            "give the world that the scene was made from"
        )
    width, height = truth.size
    first = scene.cameras[0]
    # A size is a whole number of pixels: half a pixel either way is the same shape.
    if abs(first.width_px * height - first.height_px * width) > 0.5 * max(first.width_px, width):
        raise InputError(
            f"the scene's frames are {first.width_px}x{first.height_px}, those of the world {width}x"
            f"{height}; expected the same shape: give the world that the scene was made from, or generate "
            f"the scene with --size {width}x{height}"
        )
    return tuple(camera.resized(width, height) for camera in scene.cameras)
