"""Outpainting: the street beyond the borders of a photo."""

from dataclasses import replace

import cv2
import numpy as np

from dreamdrive.prior.photo.fill import grown, inpainted
from dreamdrive.prior.photo.pavement import AHEAD, along_road
from dreamdrive.prior.photo.street import FAR_M, PhotoStreet
from dreamdrive.scene.street.street_class import FLAT, ROAD_USERS, StreetClass

THIN = (*ROAD_USERS, StreetClass.POLE)
"""What something goes on behind: all of it is hidden street."""
RIM_PX = 9
"""The outline of a road user is not exact, and its colours would be smeared over all that it hides."""


def widened(street: PhotoStreet, margin: int) -> PhotoStreet:
    """The street with so many pixels more to the left, to the right and below.

    The road goes on; all else is mirrored, and no nearer than the border. Who is cut off by a side of the
    photo goes on, too, as deep as there.
    """

    def wider(values: np.ndarray, border: int) -> np.ndarray:
        return np.asarray(cv2.copyMakeBorder(values, 0, margin, margin, margin, border))

    camera = replace(
        street.camera,
        cx_px=street.camera.cx_px + margin,
        width_px=street.camera.width_px + 2 * margin,
        height_px=street.camera.height_px + margin,
    )
    own = (street.classes == StreetClass.OWN_CAR).astype(np.uint8)
    rgb = inpainted(street.rgb, grown(own > 0, RIM_PX)) if own.any() else street.rgb
    classes = street.classes.copy()
    classes[own > 0] = StreetClass.ROAD
    height, width = classes.shape
    photo = slice(0, height), slice(margin, margin + width)
    road_users = wider(street.road_users, cv2.BORDER_REFLECT_101)
    road_users[road_users != wider(street.road_users, cv2.BORDER_REPLICATE)] = 0
    road_users[height:] = 0
    road_users[photo] = street.road_users
    hidden = np.isin(classes, THIN)
    empty = inpainted(rgb, grown(hidden, 5))
    rgb_out = wider(empty, cv2.BORDER_REFLECT_101)
    rgb_out = np.where(road_users[..., None] > 0, wider(rgb, cv2.BORDER_REFLECT_101), rgb_out)
    rgb_out[photo] = rgb
    standing = np.where(hidden, StreetClass.STRUCTURE, classes).astype(np.uint8)
    mirrored, level = wider(classes, cv2.BORDER_REFLECT_101), wider(standing, cv2.BORDER_REPLICATE)
    classes = np.where(road_users > 0, mirrored, level)
    classes[photo] = np.where(own > 0, StreetClass.ROAD, street.classes)
    depth = wider(street.depth_m, cv2.BORDER_REPLICATE)
    plane = street.ground.depth_m(camera)
    outside = np.ones(classes.shape, bool)
    outside[photo] = own > 0
    flat = outside & (np.isin(classes, FLAT) | (plane < depth))
    depth = np.where(flat, np.minimum(plane, FAR_M), depth)
    depth[outside & (classes == StreetClass.SKY)] = 0
    bare = ~outside & np.isin(classes, FLAT) & ~grown((road_users > 0) | outside, RIM_PX)
    rgb_out, left = along_road(rgb_out, camera, street.ground, flat & (plane < FAR_M), bare, AHEAD)
    rgb_out = inpainted(rgb_out, left)
    return PhotoStreet(rgb_out, camera, depth.astype(np.float32), classes, road_users, street.ground)
