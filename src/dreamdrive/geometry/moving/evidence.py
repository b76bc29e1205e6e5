"""Evidence that pixels belong to something that moves."""

from collections.abc import Mapping

import cv2
import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.depth import PosedFrames, by_frame, sample
from dreamdrive.geometry.moving import contest
from dreamdrive.geometry.moving.flow import PairFlow
from dreamdrive.geometry.moving.oncoming import oncoming
from dreamdrive.geometry.moving.outline import outline
from dreamdrive.geometry.options import MovingOptions
from dreamdrive.vision.windows import grown, window_px

FLAGGED = 0.5  # evidence from which a pixel counts as moving
_VOTING_REACH = 2
_CLOSE_SHARE = 9 / 480  # of the image width
_OPEN_SHARE = 5 / 480
_MIN_SURE_SHARE = 0.05  # of a component
_MIN_SURE_PX = 12
_STANDING_LEVELS = 10.0  # grey levels from the temporal median


def moving_evidence(
    view: PosedFrames,
    flows: Mapping[int, list[PairFlow]],
    inverse_depth: Float[np.ndarray, "f h w"],
    sky: Bool[np.ndarray, "f h w"],
    known_depth: bool,
) -> Float[np.ndarray, "f h w"]:
    """Evidence in [0, 1] for a moving camera; ``FLAGGED`` and more inside whole moving objects, never sky.

    Each frame's contest is carried along the flow to its neighbours, which vote; connected regions with
    enough sure pixels are kept, filled and completed to whole things. Oncoming vehicles look like nearer
    static ones; they are found where they visibly do not stand on the road, see ``oncoming``, unless depth
    was given rather than found.
    """
    options = view.options.moving

    def judged(frame: int) -> contest.ContestVerdict:
        return contest.judge(view, frame, flows[frame], inverse_depth[frame], known_depth)

    verdicts = by_frame(view, judged)
    likely = {
        f: _beyond(v, options.excess_px, options.gain_levels, options).astype(np.float32)
        for f, v in verdicts.items()
    }

    def decided(frame: int) -> np.ndarray:
        sure = _beyond(verdicts[frame], options.sure_excess_px, options.sure_gain_levels, options)
        return decide(_vote(likely, frame, flows[frame]), sure, view.usable[frame], options)

    found = by_frame(view, decided)
    coming: dict[int, np.ndarray] = {}
    if options.oncoming and not known_depth:
        coming = {frame: mask & ~sky[frame] for frame, mask in oncoming(view).items()}
    found |= {frame: np.where(mask, 1, found[frame]) for frame, mask in coming.items()}
    flagged = {frame: found[frame] >= FLAGGED for frame in view.frames}
    for around in range(options.rounds):
        if around > 0:
            flagged = {
                frame: _carried(flagged, frame, flows[frame], options.least_area) for frame in view.frames
            }

        def whole(frame: int, parts: Mapping[int, np.ndarray] = flagged) -> np.ndarray:
            return outline(view, frame, flows[frame], inverse_depth[frame], parts[frame], sky[frame])

        flagged = by_frame(view, whole)
    # The flow of what is taken for standing is poor: an outline may lose it.
    flagged |= {frame: flagged[frame] | mask for frame, mask in coming.items()}
    evidence = np.zeros(inverse_depth.shape, np.float32)
    for frame in view.frames:
        inside, outside = np.maximum(found[frame], FLAGGED), np.minimum(found[frame], 0.9 * FLAGGED)
        evidence[frame] = np.where(flagged[frame], inside, outside)
    return evidence


def standing_evidence(view: PosedFrames) -> Float[np.ndarray, "f h w"]:
    """Evidence (F, H, W) in [0, 1] for a standing camera: pixels that differ from their temporal median."""
    evidence = np.zeros(view.grey.shape, np.float32)
    rgb = view.rgb[view.used].astype(np.float32)
    median = np.median(rgb, axis=0).astype(np.float32)
    # A pixel may look like any of its neighbours: edges must not fire when the standing car shakes.
    side = window_px(3, view.grey.shape[2])
    kernel = np.ones((side, side), np.uint8)
    low, high = np.asarray(cv2.erode(median, kernel)), np.asarray(cv2.dilate(median, kernel))
    for frame, picture in zip(view.frames, rgb, strict=True):
        outside = np.maximum(np.maximum(picture - high, low - picture), 0).max(axis=-1)
        difference = np.asarray(cv2.GaussianBlur(outside, (0, 0), grown(1.0, view.grey.shape[2])))
        votes = np.clip(difference / (2 * _STANDING_LEVELS), 0, 1).astype(np.float32)
        evidence[frame] = decide(
            votes, difference > 1.5 * _STANDING_LEVELS, view.usable[frame], view.options.moving
        )
    return evidence


def _beyond(
    verdict: contest.ContestVerdict, excess_px: float, gain: float, options: MovingOptions
) -> Bool[np.ndarray, "h w"]:
    beyond = (verdict.excess_px > excess_px) & (verdict.gain > gain)
    return beyond | verdict.off_line if options.off_line else beyond


def _vote(
    likely: Mapping[int, Float[np.ndarray, "h w"]], frame: int, flows: list[PairFlow]
) -> Float[np.ndarray, "h w"]:
    """Mean of the frame's own opinion, counted twice, and of its neighbours' at the same thing."""
    total = 2 * likely[frame]
    count = np.full_like(total, 2)
    for flow in flows:
        if abs(flow.offset) <= _VOTING_REACH:
            total = total + np.where(flow.trusted, sample(likely[flow.source], flow.x, flow.y), 0)
            count = count + flow.trusted
    return total / count


def _carried(
    flagged: Mapping[int, Bool[np.ndarray, "h w"]], frame: int, flows: list[PairFlow], least_area: float
) -> Bool[np.ndarray, "h w"]:
    """What at least half of the frame and its neighbours hold for moving, without specks."""
    votes = _vote({key: value.astype(np.float32) for key, value in flagged.items()}, frame, flows)
    side = window_px(3, votes.shape[1])
    mask = cv2.morphologyEx((votes >= 0.5).astype(np.uint8), cv2.MORPH_OPEN, np.ones((side, side), np.uint8))
    _, found, stats, _ = cv2.connectedComponentsWithStats(mask)
    large = stats[:, cv2.CC_STAT_AREA] >= least_area * mask.size
    large[0] = False
    return large[np.asarray(found, np.intp)]


def decide(
    votes: Float[np.ndarray, "h w"],
    sure: Bool[np.ndarray, "h w"],
    usable: Bool[np.ndarray, "h w"],
    options: MovingOptions = MovingOptions(),
) -> Float[np.ndarray, "h w"]:
    """Votes in [0, 1] to evidence: at least ``FLAGGED`` inside kept and filled regions, less outside.

    A region is kept that has some sure pixels. Evidence is 0 where pixels are not usable.
    """
    mask = ((votes >= options.vote) & usable).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _ellipse(_CLOSE_SHARE * mask.shape[1]))
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, _ellipse(_OPEN_SHARE * mask.shape[1]))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    sure_px = np.bincount(labels[sure], minlength=count)
    area = stats[:, cv2.CC_STAT_AREA]
    keep = (area >= options.least_area * mask.size) & (
        sure_px >= np.maximum(_MIN_SURE_PX, _MIN_SURE_SHARE * area)
    )
    flagged = np.zeros(mask.shape, bool)
    for label in np.flatnonzero(keep[1:]) + 1:
        flagged |= fill(labels == label)
    inside = np.maximum(votes, FLAGGED)
    return np.where(usable, np.where(flagged, inside, np.minimum(votes, 0.9 * FLAGGED)), 0).astype(np.float32)


def fill(region: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """The region with everything that lies between parts of it, both along its row and its column.

    Where it touches an edge of the image it is taken to go on beyond.
    """
    padded = np.pad(region, 1)
    padded[0, 1:-1], padded[-1, 1:-1] = region[0].any(), region[-1].any()
    padded[1:-1, 0], padded[1:-1, -1] = region[:, 0].any(), region[:, -1].any()

    def between(axis: int) -> np.ndarray:
        ahead = np.logical_or.accumulate(padded, axis=axis)
        behind = np.flip(np.logical_or.accumulate(np.flip(padded, axis), axis=axis), axis)
        return ahead & behind

    return (between(0) & between(1))[1:-1, 1:-1]


def _ellipse(about_px: float) -> np.ndarray:
    size_px = max(3, 2 * round((about_px - 1) / 2) + 1)
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size_px, size_px))
