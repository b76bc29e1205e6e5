"""The dense half of the classical reconstruction: depth, confidence, sky and motion of posed frames."""

from dataclasses import replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt16

from dreamdrive.compute.device import CPU, chosen_device
from dreamdrive.geometry.cameras import Posed
from dreamdrive.geometry.depth import (
    PAVED,
    Fused,
    PosedFrames,
    Tell,
    above_horizon,
    agreement,
    combine,
    fill_flanks,
    fused,
    make_view,
    preferred,
    settled_in_time,
    shifted_road_users,
    sky_mask,
    sweep_frames,
    sweep_frames_on,
    temporal_neighbours,
    unheard,
    with_outlines,
    with_stereo,
)
from dreamdrive.geometry.moving import (
    FLAGGED,
    PairFlow,
    moving_evidence,
    neighbour_flows,
    standing_evidence,
    too_near,
    whole_road_users,
)
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.progress import Keep, at_once
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.street.look import Look
from dreamdrive.vision.flow import single_threaded_opencv

MOVING_CONFIDENCE = 0.3  # of the depth of a moving thing, which its contact with the road gives
PASSES, LOOK_PASSES = 7, 6
"""How often the frames are gone through one by one: the sweep, six times for what moves, and with a look
six times for depth that the street network has a part in."""
_FAR_INVERSE = 1e-3  # 1/m; farther than 1 km there is no depth
_BACKDROP_M = 40.0
_PLANE_CONFIDENCE = 0.3
_BACKDROP_CONFIDENCE = 0.1
_SMOOTH_SHARE = 0.02  # of the image width: columns are smoothed over twice this and one more


DepthMaps = tuple[Float[np.ndarray, "f h w"], Float[np.ndarray, "f h w"]]
"""Depth along z in metres, 0 where there is none, and trust in it in [0, 1]; or inverse depth and trust."""


def densify(
    clip: Clip,
    posed: Posed,
    options: GeometryOptions = GeometryOptions(),
    measured: DepthMaps | None = None,
    tell: Tell = unheard,
    keep: Keep = at_once,
) -> Geometry:
    """The posed clip with depth, confidence, sky and moving evidence of every frame that is not held out.

    Held-out frames are not looked at and stay empty: depth, confidence and moving 0, no sky. Depth is taken
    as given in ``clip.known.depth_m`` where that is dense; else, with what is given in its pixels, as
    measured, such as by a network, else from the plane sweep, which is kept, else (standing camera, or poses
    from the fallback) from the road plane and a backdrop at 40
    m, little trusted. With a look, depth that was not given is fused with the street network's, which takes
    the place of the backdrop. What moves is found against the parallax of a moving camera or against the
    temporal median of a standing one, and with a look road users move as wholes; from fallback poses no such
    evidence is drawn. Where depth is fused, that of stereo alone is beside it, for who can tell which is
    better. ``tell`` is called for each frame of at most ``PASSES``, and with a look of
    ``LOOK_PASSES`` more, where depth was not given.
    """
    view = make_view(clip, posed.cameras, posed.fixed_regions, posed.ground, options, tell)
    known = clip.known.depth_m
    given = known is not None and float((known[view.used] > 0).mean()) >= options.depth.dense
    if known is not None and given:
        measured = known, (known > 0).astype(np.float32)
    rough = posed.standing or posed.fallback is not None
    look, found, road_users, alone = clip.look, None, None, None
    with single_threaded_opencv():
        sky = _sky(clip, view)
        if measured is not None:
            inverse = _inverse(np.where(view.used[:, None, None], measured[0], 0))
            confidence = np.where(inverse > 0, measured[1], 0).astype(np.float32)
        elif rough and look is not None:
            inverse, confidence = np.zeros(view.grey.shape, np.float32), np.zeros(view.grey.shape, np.float32)
        elif rough:
            inverse, confidence = _plane_and_backdrop(view)
        else:
            inverse, confidence = keep("swept", lambda: _swept(view, sky))
        if known is not None and not given:
            inverse, confidence = _anchored(view, known, inverse, confidence)
        if look is not None and not given:
            # Where no motion shows the road, its tilt is that of the horizon that the network sees.
            tilt_rad = look.camera.horizon_spread_px / look.camera.focal_px if rough else 0.0
            found = fused(view, look, inverse, confidence, tilt_rad)
        flows: dict[int, list[PairFlow]] = {}
        if posed.standing:
            moving = standing_evidence(view)
        elif posed.fallback is not None:
            moving = np.zeros(inverse.shape, np.float32)
        else:
            flows = neighbour_flows(view)
            likely = inverse if found is None else found.inverse
            moving = moving_evidence(view, flows, likely, sky, given)
        moving = moving * ~sky
        if look is not None and found is not None:
            nearer = too_near(found.inverse, inverse, confidence, options.users)
            moving, road_users = whole_road_users(view, look, flows, moving, nearer, found.inverse)
            still = moving < FLAGGED
            found = _settled(view, look, found, (inverse, confidence), still, still & (road_users > 0))
            if not rough:
                alone = np.where(still, inverse, 0), confidence
            inverse, confidence = found.inverse, found.confidence
        elif look is not None:
            moving, road_users = whole_road_users(view, look, flows, moving, np.zeros_like(sky), inverse)
        elif not given:
            inverse, confidence = _stand_movers(inverse, confidence, moving, view)
    geometry = _geometry(posed, view, inverse, confidence, sky, moving, found and found.spread, road_users)
    return geometry if alone is None else _with_stereo_alone(geometry, *alone)


def _settled(
    view: PosedFrames,
    look: Look,
    found: Fused,
    stereo: DepthMaps,
    still: Bool[np.ndarray, "f h w"],
    standing: Bool[np.ndarray, "f h w"],
) -> Fused:
    """What was fused, after stereo and neighbouring frames had their say on what stands."""
    found = shifted_road_users(view, look.instances, found, *stereo, standing)
    found = with_stereo(view, found, standing, *stereo)
    seen = settled_in_time(view, found.inverse, found.spread, still)
    seen = with_outlines(view, seen, still & ~np.isin(look.classes, PAVED))
    return replace(found, inverse=preferred(view, seen, *stereo, still))


def _plane_and_backdrop(view: PosedFrames) -> DepthMaps:
    inverse = np.maximum(view.plane_inverse, np.float32(1 / _BACKDROP_M))
    confidence = np.where(view.plane_inverse >= inverse, _PLANE_CONFIDENCE, _BACKDROP_CONFIDENCE)
    return inverse, confidence.astype(np.float32)


def _sky(clip: Clip, view: PosedFrames) -> Bool[np.ndarray, "f h w"]:
    sky = np.zeros(view.usable.shape, bool)
    for frame in view.frames:
        if clip.known.sky is not None:
            sky[frame] = clip.known.sky[frame] & view.usable[frame]
        elif clip.look is not None:
            sky[frame] = clip.look.sky[frame] & view.usable[frame]
        else:
            above = above_horizon(view.cameras[frame], view.ground)
            sky[frame] = sky_mask(view.rgb[frame], above, view.usable[frame])
    return sky


def _anchored(
    view: PosedFrames,
    known_m: Float[np.ndarray, "f h w"],
    inverse: Float[np.ndarray, "f h w"],
    confidence: Float[np.ndarray, "f h w"],
) -> DepthMaps:
    """Depth that was found, with that of single known pixels in its place, which no other may doubt."""
    there = (known_m > 0) & view.used[:, None, None]
    return np.where(there, _inverse(known_m), inverse), np.where(there, np.float32(1), confidence)


def _inverse(depth_m: np.ndarray) -> Float[np.ndarray, "f h w"]:
    return np.where(depth_m > 0, 1 / np.maximum(depth_m, 1e-3), 0).astype(np.float32)


def _swept(view: PosedFrames, sky: Bool[np.ndarray, "f h w"]) -> DepthMaps:
    device = chosen_device()
    found = sweep_frames(view, sky) if device == CPU else sweep_frames_on(view, sky, device)
    inverse = np.zeros(view.grey.shape, np.float32)
    confidence = np.zeros(view.grey.shape, np.float32)
    for frame, swept in found.items():
        inverse[frame] = swept.inverse_depth if swept is not None else view.plane_inverse[frame]
    filled = inverse.copy()
    for frame, swept in found.items():
        if swept is None:
            continue
        neighbours = temporal_neighbours(view.used, frame)
        agreeing = agreement(frame, neighbours, view.cameras, inverse, view.usable)
        confidence[frame] = combine(agreeing, swept.correlation, swept.on_plane)
        if not view.options.depth.flanks:
            continue
        filled[frame], confidence[frame] = fill_flanks(
            swept, confidence[frame], view.plane_inverse[frame], view.usable[frame] & ~sky[frame]
        )
    return filled, confidence


def _stand_movers(
    inverse: Float[np.ndarray, "f h w"],
    confidence: Float[np.ndarray, "f h w"],
    moving: Float[np.ndarray, "f h w"],
    view: PosedFrames,
) -> DepthMaps:
    """Moving pixels get the depth at which their column of the object meets the road."""
    inverse, confidence = inverse.copy(), confidence.copy()
    for frame in view.frames:
        flagged = moving[frame] >= FLAGGED
        upright = upright_depth(flagged, view.plane_inverse[frame])
        standing = flagged & (upright > 0)
        inverse[frame][standing] = upright[standing]
        confidence[frame][flagged] = np.where(standing, MOVING_CONFIDENCE, 0)[flagged]
    return inverse, confidence


def upright_depth(
    flagged: Bool[np.ndarray, "h w"], plane_inverse: Float[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """Inverse depth in 1/m of flagged regions, each column upright on the road; 0 where none is known.

    The lowest flagged pixel of a region's column is its contact with the road, whose plane is 0 above the
    horizon; a running median over the columns takes out notches. A region cut off by the lower edge of the
    image comes out too far away.
    """
    height, width = flagged.shape
    reach = max(1, round(_SMOOTH_SHARE * width))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(flagged.astype(np.uint8))
    inverse = np.zeros(flagged.shape, np.float32)
    for label in range(1, count):
        left, span = stats[label, cv2.CC_STAT_LEFT], stats[label, cv2.CC_STAT_WIDTH]
        region = labels[:, left : left + span] == label
        lowest = height - 1 - region[::-1].argmax(axis=0)
        contact = plane_inverse[lowest, np.arange(left, left + span)]
        padded = np.pad(contact, reach, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
        column = np.median(windows, axis=1).astype(np.float32)
        part = inverse[:, left : left + span]
        part[region] = np.broadcast_to(column, region.shape)[region]
    return inverse


def _with_stereo_alone(
    geometry: Geometry, inverse: Float[np.ndarray, "f h w"], confidence: Float[np.ndarray, "f h w"]
) -> Geometry:
    """The geometry with another inverse depth beside its own: as a ratio, which holds in any unit."""
    both = (geometry.depth_m > 0) & (inverse > _FAR_INVERSE)
    ratio = 1 / np.where(both, geometry.depth_m * inverse, 1)
    trust = np.where(both, confidence, geometry.confidence)
    return replace(geometry, stereo_ratio=ratio, stereo_confidence=trust)


def _geometry(
    posed: Posed,
    view: PosedFrames,
    inverse: Float[np.ndarray, "f h w"],
    confidence: Float[np.ndarray, "f h w"],
    sky: Bool[np.ndarray, "f h w"],
    moving: Float[np.ndarray, "f h w"],
    spread: Float[np.ndarray, "f h w"] | None,
    road_users: UInt16[np.ndarray, "f h w"] | None,
) -> Geometry:
    """What both halves found, as the next stages take it."""
    shown = view.usable & ~sky & (inverse > _FAR_INVERSE)
    depth_m = np.where(shown, 1 / np.maximum(inverse, _FAR_INVERSE), 0).astype(np.float32)
    confidence = np.where(shown, confidence, 0).astype(np.float32)
    sky = sky & view.usable
    moving = np.where(view.usable, moving, 0).astype(np.float32)
    shares = {
        "depth_share": float((depth_m[view.used] > 0).mean()),
        "confident_share": float((confidence[view.used] > 0.25).mean()),
        "sky_share": float(sky[view.used].mean()),
        "moving_share": float((moving[view.used] >= 0.5).mean()),
    }
    return Geometry(
        cameras=posed.cameras,
        depth_m=depth_m,
        confidence=confidence,
        sky=sky,
        moving=moving,
        spread=None if spread is None else np.where(shown, spread, 0).astype(np.float32),
        road_users=road_users,
        fixed_regions=posed.fixed_regions[None],
        region_names=posed.region_names,
        ground=posed.ground,
        scale=posed.scale,
        focal=posed.focal,
        detected=posed.detected,
        fallback=posed.fallback,
        details={**posed.details, **shares},
        fallback_kind=posed.fallback_kind,
        placed=posed.placed,
        metres_per_unit=posed.metres_per_unit,
    )
