"""First survey of a clip: its motion, its regions fixed to the camera, its light."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from dreamdrive.geometry.evidence import features, masks, motion
from dreamdrive.geometry.evidence.features import Features
from dreamdrive.geometry.evidence.masks import Fixed
from dreamdrive.geometry.evidence.motion import PictureMotion
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.vision.windows import window_px

_AROUND_PX = 5  # the side of the window that outlines grow by: they are not exact


@dataclass(frozen=True)
class Evidence:
    """What the pictures show before any geometry."""

    grey: UInt8[np.ndarray, "f h w"]  # at 320 px width
    street: Bool[np.ndarray, "f h w"]  # pixels that belong to the street, at that size
    small: Camera  # pinhole of that size
    working: Camera  # pinhole of the size at which features are sought
    motion: PictureMotion
    fixed: Fixed  # to the camera, at the clip's size
    detected: tuple[str, ...]  # sentences for the report


def observe(clip: Clip) -> Evidence:
    """Measure motion and find fixed regions at 320 px width."""
    camera, (width, height) = clip.rig[0], clip.size
    size = (motion.WIDTH_PX, max(1, round(height * motion.WIDTH_PX / width)))
    working = features.working_size(width, height)
    grey = features.to_grey(clip.frames, size)
    valid = resized(clip.valid, size)
    users = resized(road_users(clip), size)
    of_street = valid & ~users
    if clip.look is not None:
        of_street &= ~resized(clip.look.own_car, size)
    moves = motion.measure(grey, of_street, clip.times_s)
    in_motion = np.zeros(len(clip), bool)
    if not moves.standing:
        in_motion[:-1] |= moves.moving
        in_motion[1:] |= moves.moving
    fixed = masks.find_fixed(grey, np.logical_and.reduce(valid), in_motion, clip.size)
    if clip.look is not None:
        fixed = masks.with_own_car(fixed, np.median(clip.look.own_car, axis=0) > 0)
    street = valid & ~users & ~resized(((fixed.regions > 0) | fixed.objects)[None], size)
    detected = masks.describe(fixed)
    if clip.look is not None and not clip.known.focal:
        detected.append(
            f"the street network sees a field of view of {np.degrees(clip.look.camera.hfov_rad):.0f} "
            f"degrees, give or take {100 * clip.look.camera.focal_spread:.0f} %: it is taken unless turning "
            "shows another"
        )
    if moves.brightness < motion.DARK_LEVEL:
        detected.append(
            f"the clip is dark: nine tenths of the pixels lie below grey level {moves.brightness:.0f} of 255"
        )
    if moves.tracks < motion.FEW_TRACKS:
        detected.append(f"little texture to follow: {moves.tracks:.0f} corners in a typical frame")
    small, large = camera.resized(*size), camera.resized(*working)
    return Evidence(grey, street, small, large, moves, fixed, tuple(detected))


def working_frames(
    clip: Clip, evidence: Evidence, times: int = 1
) -> tuple[UInt8[np.ndarray, "f h w"], Bool[np.ndarray, "f h w"]]:
    """Grey frames at a multiple of the working size and the pixels in which features may lie."""
    size = (times * evidence.working.width_px, times * evidence.working.height_px)
    return features.to_grey(clip.frames, size), resized(free_pixels(clip, evidence), size)


def shows_little(clip: Clip, evidence: Evidence) -> bool:
    """Whether most frames show so little of the street that they have to be looked at more closely."""
    return float(np.mean([features.is_little(each) for each in free_pixels(clip, evidence)])) > 0.5


def find_features(clip: Clip, evidence: Evidence, closer: bool = False) -> list[Features]:
    """Features of each frame in pixels of the working size.

    A closer look finds them in pictures of twice the size, faint ones, too. Where frames show little of the
    street there are few otherwise: on drawn queues, a quarter of whose picture is street at most, 55 to 430 a
    frame, and paths folded; closer 800 and more. On recorded motorways models have three times the points.
    """
    if not closer:
        return features.extract(*working_frames(clip, evidence))
    found = features.extract(*working_frames(clip, evidence, 2), features.FAINT)
    return [features.scaled(each, 0.5) for each in found]


def free_pixels(clip: Clip, evidence: Evidence) -> Bool[np.ndarray, "f h w"]:
    """Pixels (F, H, W) that show the street: road users and what keeps its place in the image are none."""
    return clip.valid & ~(evidence.fixed.regions > 0) & ~evidence.fixed.objects & ~road_users(clip)


def road_users(clip: Clip) -> Bool[np.ndarray, "f h w"]:
    """Pixels (F, H, W) that the street network takes for road users, and those around them; else none.

    Those that stand are left out, too: nobody knows yet which do.
    """
    if clip.look is None:
        return np.zeros(clip.valid.shape, bool)
    side = window_px(_AROUND_PX, clip.size[0])
    kernel = np.ones((side, side), np.uint8)
    return np.stack([cv2.dilate((each > 0).astype(np.uint8), kernel) > 0 for each in clip.look.instances])


def resized(masks: Bool[np.ndarray, "f _ _"], size: Sequence[int]) -> Bool[np.ndarray, "f h w"]:
    """Masks at another width and height."""
    nearest = cv2.INTER_NEAREST
    return np.stack([cv2.resize(mask.astype(np.uint8), size, interpolation=nearest) > 0 for mask in masks])
