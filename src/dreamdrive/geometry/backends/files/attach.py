"""Geometry of files attached to a clip: checks, crops, units and the frame of the first camera."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.cameras.lens import SourceLens
from dreamdrive.data.cameras.poses import to_first
from dreamdrive.data.formats.cameras import different
from dreamdrive.data.frames.size import Sizing
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files.depth import read_depth
from dreamdrive.geometry.backends.files.formats import recognise
from dreamdrive.geometry.backends.files.given import NAME, DepthFiles, FileGeometry
from dreamdrive.geometry.backends.files.wanted import PosesMissingError, Wanted
from dreamdrive.geometry.road import depth_ratios, factor_of
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known

_SAME_PINHOLE = 0.05
"""How far the focal length of files may be from that of frames that were undistorted to a known pinhole."""
_ASPECT_TOLERANCE = 0.01
_LEAST_SHARE = 0.5
"""Part of the frames that have to have poses for the others to be left out."""


@dataclass(frozen=True)
class OntoClip:
    """How the frames of a clip were cut out of the source's pictures.

    Files may be for the source's pictures or for the clip's frames, at any size: the aspect tells which.
    Sizes are width and height in pixels.
    """

    size: tuple[int, int]  # of the clip
    source: tuple[int, int]  # of the source's pictures
    scaled: tuple[int, int]  # to which these were scaled
    offset: tuple[int, int]  # columns and rows that were then cut away at the left and the top
    lens: SourceLens | None  # that was taken out of the frames

    @staticmethod
    def of(clip: Clip) -> "OntoClip":
        """That of a clip; without a recording the frames themselves are the pictures."""
        taken = clip.recorded
        if taken is None:
            return OntoClip(clip.size, clip.size, clip.size, (0, 0), None)
        lens = None if taken.lens is None else SourceLens.from_json(taken.lens)
        return OntoClip(clip.size, taken.size, taken.scaled, taken.offset, lens)

    def sizing(self, made_for: tuple[int, int], where: str) -> Sizing:
        """How a picture of the size ``made_for`` becomes a frame."""
        aspect = made_for[0] / made_for[1]
        off_frame = abs(aspect * self.size[1] / self.size[0] - 1)
        off_source = abs(aspect * self.source[1] / self.source[0] - 1)
        if min(off_frame, off_source) > _ASPECT_TOLERANCE:
            wide, high = self.source
            raise InputError(
                f"{where}: made for {made_for[0]}x{made_for[1]}, but the clip is {wide}x{high}, another "
                "aspect; give the geometry for the clip's picture, or choose --size to match"
            )
        if made_for != self.size and off_source <= off_frame:
            return Sizing(made_for, self.scaled, self.offset, self.size)
        return Sizing(made_for, self.size, (0, 0), self.size)

    def depth(self, depth: Float[np.ndarray, "h w"], bent: bool, where: str) -> Float[np.ndarray, "h2 w2"]:
        """The depth of each pixel of a frame: that of the pixel of the picture in which its centre lies.

        Nothing is averaged: a mean across an edge is a depth at which there is nothing. The picture may still
        be bent by the clip's lens.
        """
        high, wide = depth.shape
        sizing = self.sizing((wide, high), where)
        (width, height), (left, top) = sizing.target, sizing.offset
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        if bent and self.lens is not None:
            x, y = _bent(self.lens)
        columns = np.floor((x + left) * (wide / sizing.scaled[0]))
        rows = np.floor((y + top) * (high / sizing.scaled[1]))
        inside = (columns >= 0) & (columns < wide) & (rows >= 0) & (rows < high)
        found = np.zeros((height, width), np.float32)
        found[inside] = depth[rows[inside].astype(int), columns[inside].astype(int)]
        return found


def _bent(lens: SourceLens) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
    """Where the distorted image has each pixel centre of the pinhole, in pixels of the clip's size."""
    camera = lens.camera
    rays = camera.rays()[..., :2].reshape(-1, 2)
    spots = lens.distortion.distort(rays) * (camera.fx_px, camera.fy_px) + (camera.cx_px, camera.cy_px)
    spots[~lens.distortion.unfolded(rays)] = -1e4
    shape = (camera.height_px, camera.width_px)
    spots = np.nan_to_num(spots, nan=-1e4)
    return spots[:, 0].reshape(shape), spots[:, 1].reshape(shape)


def attach(clip: Clip, path: Path, source: Path | None = None) -> Clip:
    """The clip with what the files say in its rig and ``known``, and more to say in its notes.

    Args:
        clip: The clip.
        path: A file or a folder of any format that ``formats.recognise`` knows.
        source: The recording of the clip, for its names and its length; without it, where the clip says that
            it came from.

    Raises:
        InputError: A file is missing or damaged, or does not fit the clip.

    Frames that a model did not register are left out, and that is said.
    """
    reader, place = recognise(path)
    try:
        given, gaps = reader(place, Wanted.of(clip, source)), list[str]()
    except PosesMissingError as missing:
        clip, gaps = _with_poses(clip, missing)
        given = reader(place, Wanted.of(clip, source))
    onto = OntoClip.of(clip)
    rig, camera = _rig(clip, given, onto, str(place))
    bent = not given.cameras or any(each.distortion is not None for each in given.cameras)
    depth, notes = _depth(given.depth, onto, len(clip), bent)
    poses = to_first(given.world_from_camera)
    first = given.world_from_camera[0]
    points = None if given.sparse is None else (given.sparse.points - first[:3, 3]) @ first[:3, :3]
    known = replace(
        clip.known,
        world_from_camera=poses,
        intrinsics=clip.known.intrinsics or bool(given.cameras),
        depth_m=depth,
        metric=given.metric,
        points=points,
    )
    said = [*clip.provenance.get("notes", []), *gaps, *given.notes, *notes]
    if given.cameras and not clip.known.intrinsics:
        said.append(f"The focal length is that of {place.name}, not the one that was taken before.")
    attached = replace(clip, rig=rig, camera=camera, known=known)
    if not given.metric and depth is not None and given.depth.metric:
        known, note = _scaled_by_depth(attached, given, str(place))
        attached = replace(attached, known=known)
        said.append(note)
    return replace(attached, provenance={**clip.provenance, "notes": said})


def _with_poses(clip: Clip, missing: PosesMissingError) -> tuple[Clip, list[str]]:
    """The frames of the clip that have poses, from time 0 on, and what to say about the others."""
    kept = missing.kept
    if len(kept) < _LEAST_SHARE * len(clip) or len(kept) < 2:
        raise InputError(f"{missing}; expected poses for at least half of them: add them to the model")
    rest = clip.of_frames(kept)
    held_out = rest.held_out & (np.arange(len(kept)) > 0) & (np.arange(len(kept)) < len(kept) - 1)
    rest = replace(rest, times_s=rest.times_s - rest.times_s[0], held_out=held_out)
    return rest, [f"{missing}: these frames are left out."]


def _rig(
    clip: Clip, given: FileGeometry, onto: OntoClip, where: str
) -> tuple[tuple[Camera, ...], Int[np.ndarray, " f"]]:
    """The pinholes of the frames: those of the files, or the clip's own where its lens was taken out."""
    if not given.cameras:
        return clip.rig, clip.camera
    cameras, camera = different(given.cameras)
    bend = next((each.distortion for each in cameras if each.distortion is not None), None)
    if bend is None:
        rig = tuple(onto.sizing(each.size, where).camera(each.camera) for each in cameras)
        if onto.lens is not None:
            _check_same(rig, onto.lens.camera, where)
        return rig, camera
    if onto.lens is None:
        numbers = " ".join(f"{each:.4g}" for each in bend.coefficients)
        raise InputError(
            f"{where}: its camera has the lens distortion {bend.model} {numbers}, but the frames were read "
            "as a pinhole's: give it as --intrinsics, too, without --hfov, or undistort the pictures first"
        )
    if len(cameras) > 1:
        raise InputError(f"{where}: {len(cameras)} cameras with distortion; expected one for all frames")
    onto.sizing(cameras[0].size, where)
    return clip.rig, clip.camera


def _check_same(rig: tuple[Camera, ...], pinhole: Camera, where: str) -> None:
    for camera in rig:
        if abs(camera.fx_px / pinhole.fx_px - 1) > _SAME_PINHOLE:
            raise InputError(
                f"{where}: a pinhole with a focal length of {camera.fx_px:.1f} px at the clip's size, but "
                f"the frames were undistorted to one of {pinhole.fx_px:.1f} px; read the pictures that the "
                "files are for, without --intrinsics"
            )


def _depth(
    files: DepthFiles, onto: OntoClip, count: int, bent: bool
) -> tuple[Float[np.ndarray, "f h w"] | None, list[str]]:
    if not files.of:
        return None, []
    width, height = onto.size
    depth = np.zeros((count, height, width), np.float32)
    taken: set[str] = set()
    for row, path in files.of.items():
        picture, unit = read_depth(path, files.unit, kitti=files.kitti)
        depth[row] = onto.depth(picture, bent, str(path))
        taken |= set() if unit is None else {f"{path.suffix.lower()[1:]} as {unit}"}
    notes: list[str] = []
    if taken:
        how = ", ".join(sorted(taken))
        notes.append(f"The unit of the depth files is not declared ({NAME}, depth_unit): {how} is taken.")
    if len(files.of) < count:
        notes.append(f"{len(files.of)} of {count} frames have a depth file.")
    return depth, notes


def _scaled_by_depth(clip: Clip, given: FileGeometry, where: str) -> tuple[Known, str]:
    """Poses and points in metres, where the depth is and the poses are not: sparse points tell the factor."""
    poses, points = clip.known.world_from_camera, clip.known.points
    ratios = np.zeros(0)
    if given.sparse is not None and points is not None and poses is not None and len(clip.rig) == 1:
        ratios = depth_ratios(clip, clip.rig[0], poses, points, given.sparse.seen)
    if poses is None or points is None or not len(ratios):
        raise InputError(
            f"{where}: its poses are in an unknown unit, but the depth is in metres, and no sparse points "
            f'tell the one from the other; write {{"metric": true}} into {NAME} if the poses are in metres, '
            'or {"depth_unit": "poses"} if the depth has their unit'
        )
    factor, spread = factor_of(ratios)
    scaled = poses.copy()
    scaled[:, :3, 3] *= factor
    known = replace(clip.known, world_from_camera=scaled, points=points * factor, metric=True)
    return known, (
        f"The depth files give the scale of the poses: {factor:.4g} m a unit, from {len(ratios)} views of "
        f"sparse points, spread {100 * spread:.0f} %."
    )
