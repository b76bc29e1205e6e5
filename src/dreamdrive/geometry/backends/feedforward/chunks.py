"""Long clips in chunks that overlap, and one world from all of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.feedforward.network import FeedforwardResult
from dreamdrive.geometry.measured import ranks, weighted_median
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.similarity import Similarity, nearest_rotation

_PIXELS = 4_000  # of a frame that take part in joining; more do not make it better


@dataclass(frozen=True)
class Joined:
    """All frames of a clip in one world."""

    world_from_camera: Float[np.ndarray, "f 4 4"]
    depth: Float[np.ndarray, "f h w"]  # along z in the unit of the poses, the geometric mean of the chunks'
    confidence: Float[np.ndarray, "f h w"]  # as the network gave it
    scales: Float[np.ndarray, " c"]  # units of the chunks in this one
    miss: Float[np.ndarray, " d"]  # median distance of the points two chunks share, relative to their depth


def chunks(count: int, length: int, overlap: int) -> list[range]:
    """Frames of each chunk: all of one length, with at least ``overlap`` shared, the last up to the end."""
    if not 0 < overlap < length:
        raise ValueError(f"chunks of {length} frames cannot overlap by {overlap}")
    if count <= length:
        return [range(count)]
    starts = [*range(0, count - length, length - overlap), count - length]
    return [range(start, start + length) for start in starts]


def join(
    parts: Sequence[tuple[range, FeedforwardResult]],
    camera: Camera,
    usable: Bool[np.ndarray, "f h w"],
    source_index: Int[np.ndarray, " f"],
) -> Joined:
    """Bring each chunk onto the one before by the frames they share.

    Where two chunks overlap, a frame is taken from the one whose edge is further away. Of the pictures are
    the camera, the usable pixels and the numbers in the source.
    """
    similarities, misses = [Similarity(1.0, np.eye(3), np.zeros(3))], []
    for before, after in pairwise(parts):
        step, miss = _onto(before, after, camera, usable, source_index)
        last = similarities[-1]
        similarities.append(
            Similarity(last.scale * step.scale, last.rotation @ step.rotation, last(step.translation))
        )
        misses.append(miss)
    unit = float(np.exp(np.mean([np.log(each.scale) for each in similarities])))
    poses, depth, confidence = [], [], []
    for index, ((frames, seen), similarity) in enumerate(zip(parts, similarities, strict=True)):
        first = 0 if index == 0 else _middle(parts[index - 1][0], frames)
        last = frames.stop if index + 1 == len(parts) else _middle(frames, parts[index + 1][0])
        own = slice(first - frames.start, last - frames.start)
        moved = seen.world_from_camera[own].copy()
        moved[:, :3, 3] = similarity(moved[:, :3, 3]) / unit
        moved[:, :3, :3] = similarity.rotation @ moved[:, :3, :3]
        poses.append(moved)
        depth.append(seen.depth[own] * np.float32(similarity.scale / unit))
        confidence.append(seen.confidence[own])
    return Joined(
        np.concatenate(poses),
        np.concatenate(depth),
        np.concatenate(confidence),
        np.array([each.scale for each in similarities]) / unit,
        np.array(misses, dtype=np.float64),
    )


def _middle(before: range, after: range) -> int:
    return (after.start + before.stop) // 2


def _onto(
    before: tuple[range, FeedforwardResult],
    after: tuple[range, FeedforwardResult],
    camera: Camera,
    usable: Bool[np.ndarray, "f h w"],
    source_index: Int[np.ndarray, " f"],
) -> tuple[Similarity, float]:
    """The similarity from the world of a chunk to that of the one before, and how far it misses.

    A frame is the same camera in both, so the ratio of depths is the scale, whatever the poses; and the poses
    give the rest. Registering points instead makes the path jump where chunks meet: a depth that is 1 % off
    moves points further than the camera goes between two frames.
    """
    shared = range(after[0].start, before[0].stop)
    (target, target_depth, target_rank), (source, source_depth, source_rank) = (
        _part(part, shared, camera) for part in (before, after)
    )
    weights, stride = target_rank * source_rank, _stride(camera)
    counts = (weights > 0) & usable[shared.start : shared.stop, ::stride, ::stride]
    if not counts.any():
        first, last = source_index[[shared.start, shared.stop - 1]]
        raise InputError(f"frames {first} to {last}: two chunks see nothing in common there")
    ratio = np.log(target_depth[counts] / source_depth[counts])
    scale = float(np.exp(weighted_median(ratio, weights[counts])))
    turns = target[:, :3, :3] @ np.swapaxes(source[:, :3, :3], 1, 2)
    rotation = nearest_rotation(turns.sum(axis=0))
    translation = np.median(target[:, :3, 3] - scale * source[:, :3, 3] @ rotation.T, axis=0)
    found = Similarity(scale, rotation, translation)
    rays = camera.rays()[::stride, ::stride]
    distance = found(_points(source, source_depth, rays)) - _points(target, target_depth, rays)
    return found, float(np.median(np.linalg.norm(distance, axis=-1)[counts] / target_depth[counts]))


def _part(
    part: tuple[range, FeedforwardResult], shared: range, camera: Camera
) -> tuple[Float[np.ndarray, "n 4 4"], Float[np.ndarray, "n h w"], Float[np.ndarray, "n h w"]]:
    """Poses of the shared frames, some of their depth, and the share of it trusted less; 0 without depth."""
    frames, seen = part
    own = slice(shared.start - frames.start, shared.stop - frames.start)
    depth, trust = (
        values[own, :: _stride(camera), :: _stride(camera)].astype(np.float64)
        for values in (seen.depth, seen.confidence)
    )
    return seen.world_from_camera[own], depth, np.where(depth > 0, ranks(trust), 0)


def _points(
    poses: Float[np.ndarray, "n 4 4"], depth: Float[np.ndarray, "n h w"], rays: Float[np.ndarray, "h w 3"]
) -> Float[np.ndarray, "n h w 3"]:
    turns = poses[:, None, None, :3, :3]
    return (turns @ (rays * depth[..., None])[..., None])[..., 0] + poses[:, None, None, :3, 3]


def _stride(camera: Camera) -> int:
    return max(1, int(np.sqrt(camera.width_px * camera.height_px / _PIXELS)))
