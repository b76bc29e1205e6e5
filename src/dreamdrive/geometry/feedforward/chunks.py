"""Long clips in chunks that overlap, and one world from all of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import rankdata

from dreamdrive.errors import InputError
from dreamdrive.geometry.feedforward.network import Seen
from dreamdrive.geometry.registration import Similarity, register
from dreamdrive.scene.camera import Camera

_PIXELS = 4_000  # of a frame that take part in joining; more do not make it better
_ROBUST_STEPS = 10


@dataclass(frozen=True)
class Joined:
    """All frames of a clip in one world.

    Attributes:
        world_from_camera: Poses (F, 4, 4).
        depth: Depth along z (F, H, W) in their unit, the geometric mean of the chunks' units.
        confidence: As the network gave it (F, H, W).
        scales: Units of the chunks (C,) in this one.
        miss: Median distance (C-1,) of the points that two chunks share, relative to their depth.
    """

    world_from_camera: Float[np.ndarray, "f 4 4"]
    depth: Float[np.ndarray, "f h w"]
    confidence: Float[np.ndarray, "f h w"]
    scales: Float[np.ndarray, " c"]
    miss: Float[np.ndarray, " d"]


def chunks(count: int, length: int, overlap: int) -> list[range]:
    """Frames of each chunk: all of one length, the last moved back to the end of the clip.

    Args:
        count: Frames of the clip.
        length: Frames of a chunk.
        overlap: Frames that neighbours share at least.
    """
    if not 0 < overlap < length:
        raise ValueError(f"chunks of {length} frames cannot overlap by {overlap}")
    if count <= length:
        return [range(count)]
    starts = [*range(0, count - length, length - overlap), count - length]
    return [range(start, start + length) for start in starts]


def join(parts: Sequence[tuple[range, Seen]], camera: Camera, usable: Bool[np.ndarray, "f h w"]) -> Joined:
    """Bring each chunk onto the one before by the similarity of the pixels they share.

    Where two chunks overlap, a frame is taken from the one whose edge is further away.

    Args:
        parts: Frames of each chunk and what was seen in them.
        camera: Pinhole of the pictures.
        usable: Pixels (F, H, W) that show the street.

    Raises:
        InputError: Two chunks have nothing in common.
    """
    similarities, misses = [Similarity(1.0, np.eye(3), np.zeros(3))], []
    for before, after in pairwise(parts):
        step, miss = _onto(before, after, camera, usable)
        similarities.append(_after(similarities[-1], step))
        misses.append(miss)
    unit = float(np.exp(np.mean([np.log(each.scale) for each in similarities])))
    poses, depth, confidence = [], [], []
    for index, ((frames, seen), similarity) in enumerate(zip(parts, similarities, strict=True)):
        first = 0 if index == 0 else _middle(parts[index - 1][0], frames)
        last = frames.stop if index + 1 == len(parts) else _middle(frames, parts[index + 1][0])
        own = slice(first - frames.start, last - frames.start)
        poses.append(_moved(seen.world_from_camera[own], similarity, unit))
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
    before: tuple[range, Seen], after: tuple[range, Seen], camera: Camera, usable: Bool[np.ndarray, "f h w"]
) -> tuple[Similarity, float]:
    """The similarity from the world of a chunk to that of the one before, and how far it misses."""
    shared = range(after[0].start, before[0].stop)
    target, target_rank = _points(before, shared, camera)
    source, source_rank = _points(after, shared, camera)
    stride = _stride(camera)
    depth = before[1].depth[shared.start - before[0].start :, ::stride, ::stride]
    # A point's error grows with its depth.
    weights = target_rank * source_rank / np.maximum(depth, np.finfo(np.float32).tiny)
    weights = np.where(usable[shared.start : shared.stop, ::stride, ::stride], weights, 0)
    counts = weights > 0
    if np.count_nonzero(counts) < 3:
        raise InputError(
            f"frames {shared.start} to {shared.stop - 1}: two chunks see nothing in common there"
        )
    found = register(source, target, weights, robust_steps=_ROBUST_STEPS)
    distance = np.linalg.norm(found(source[counts]) - target[counts], axis=-1)
    return found, float(np.median(distance / depth[counts]))


def _points(
    part: tuple[range, Seen], shared: range, camera: Camera
) -> tuple[Float[np.ndarray, "n h w 3"], Float[np.ndarray, "n h w"]]:
    """Some points of the shared frames, and the share of the chunk's pixels trusted less; 0 without depth."""
    frames, seen = part
    own = slice(shared.start - frames.start, shared.stop - frames.start)
    stride = _stride(camera)
    depth = seen.depth[own, ::stride, ::stride].astype(np.float64)
    rays = camera.rays()[::stride, ::stride]
    poses = seen.world_from_camera[own, None, None]
    points = (poses[..., :3, :3] @ (rays * depth[..., None])[..., None])[..., 0] + poses[..., :3, 3]
    trust = seen.confidence[own, ::stride, ::stride]
    rank = rankdata(trust).reshape(trust.shape) / trust.size
    return points, np.where(depth > 0, rank, 0)


def _stride(camera: Camera) -> int:
    return max(1, int(np.sqrt(camera.width_px * camera.height_px / _PIXELS)))


def _after(second: Similarity, first: Similarity) -> Similarity:
    return Similarity(second.scale * first.scale, second.rotation @ first.rotation, second(first.translation))


def _moved(
    poses: Float[np.ndarray, "n 4 4"], similarity: Similarity, unit: float
) -> Float[np.ndarray, "n 4 4"]:
    moved = poses.copy()
    moved[:, :3, :3] = similarity.rotation @ poses[:, :3, :3]
    moved[:, :3, 3] = similarity(poses[:, :3, 3]) / unit
    return moved
