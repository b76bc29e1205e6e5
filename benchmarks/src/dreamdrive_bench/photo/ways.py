"""Ways to tell from one picture what a camera will see from elsewhere."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data.photo import Photo
from dreamdrive.prior.photo import Layers, PhotoStreet, flowing, grown, height_of, layers_of, seen_in, view
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.look import Look
from dreamdrive.scene.street.street_class import FLAT, StreetClass
from dreamdrive_bench.common.twin import TWIN

BACKDROP_M = 40.0
"""Where what stands is put by the plane and backdrop."""


@dataclass(frozen=True)
class Sight:
    """What a camera truly saw so many seconds later: its pose in the frame of the first picture's camera."""

    name: str
    t_s: float
    pose: Float[np.ndarray, "4 4"]
    rgb: UInt8[np.ndarray, "h w 3"]


Picture = UInt8[np.ndarray, "h w 3"]


@dataclass
class Start:
    """The picture that all ways begin from."""

    rgb: Picture
    camera: Camera
    height_m: float
    calibrated: bool

    @cached_property
    def _seen(self) -> tuple[PhotoStreet, Look]:
        photo = Photo(self.rgb, self.camera.at(np.eye(4)), self.calibrated, ())
        return seen_in(photo, TWIN, self.height_m)[:2]

    @property
    def street(self) -> PhotoStreet:
        """As the prior sees it."""
        return self._seen[0]

    @property
    def told_m(self) -> float:
        """The camera's height as the photo alone tells it."""
        return height_of(self._seen[1], self.street.camera).metres

    @cached_property
    def layers(self) -> Layers:
        """As the prior draws it."""
        return layers_of(self.street)

    @cached_property
    def backdrop(self) -> Layers:
        """The road plane and a wall behind it."""
        plane = self.street.ground.depth_m(self.street.camera)
        depth = np.where(self.street.sky, 0, np.minimum(plane, BACKDROP_M)).astype(np.float32)
        return layers_of(replace(self.street, depth_m=depth))

    @cached_property
    def upright(self) -> Layers:
        """Pop-up: what stands has the depth of its foot on the road (Hoiem et al. 2005)."""
        street = self.street
        plane = street.ground.depth_m(street.camera)
        flat = np.isin(street.classes, FLAT)
        depth = np.where(flat, plane, np.inf)
        for row in range(len(depth) - 2, -1, -1):
            depth[row] = np.where(flat[row], plane[row], depth[row + 1])
        depth = np.where(street.sky | ~np.isfinite(depth), 0, np.minimum(depth, 250.0)).astype(np.float32)
        return layers_of(replace(street, depth_m=depth))


def drawn(start: Start, sight: Sight) -> Picture:
    """By the prior, where everything stands."""
    return view(start.layers, start.street.camera.at(sight.pose), start.street)[0]


def flows(start: Start, sight: Sight) -> Picture:
    """By the prior, with traffic as fast as the own car."""
    if not sight.t_s:
        return drawn(start, sight)
    speed_m_s = float(np.linalg.norm(sight.pose[:3, 3])) / sight.t_s
    velocities = flowing(start.street, speed_m_s)
    ahead = 1 + np.flatnonzero(velocities[:, 2] > 0)
    layers = layers_of(start.street, ahead.tolist()).at(sight.t_s, velocities)
    return view(layers, start.street.camera.at(sight.pose), start.street)[0]


def frozen(start: Start, _: Sight) -> Picture:
    """The picture itself."""
    return start.rgb


def homography(start: Start, sight: Sight) -> Picture:
    """The road's plane carries what lies below the horizon; above it a picture only turns."""
    camera, ground, pose = start.street.camera, start.street.ground, sight.pose
    there = camera.at(pose)
    depth = np.minimum(ground.depth_m(there), 1e4)
    rays = there.rays() @ pose[:3, :3].T
    points = rays * depth[..., None] + pose[:3, 3]
    above = ~np.isfinite(ground.depth_m(there))
    points[above] = rays[above] * 1e4
    at = camera.at(np.eye(4)).project(points.reshape(-1, 3)).reshape(*depth.shape, 3)
    ahead = at[..., 2] > 0.2
    u = np.where(ahead, at[..., 0] - 0.5, -1).astype(np.float32)
    v = np.where(ahead, at[..., 1] - 0.5, -1).astype(np.float32)
    return cv2.remap(start.rgb, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def popped_up(start: Start, sight: Sight) -> Picture:
    """By the classical pop-up."""
    return view(start.upright, start.street.camera.at(sight.pose), start.street)[0]


def before_backdrop(start: Start, sight: Sight) -> Picture:
    """By road and backdrop."""
    return view(start.backdrop, start.street.camera.at(sight.pose), start.street)[0]


def _with_own_car(way: Callable[[Start, Sight], Picture]) -> Callable[[Start, Sight], Picture]:
    """What is fixed to the camera stays where it was in the picture: no way has to guess it."""

    def shown(start: Start, sight: Sight) -> Picture:
        own = grown(start.street.classes == StreetClass.OWN_CAR, 5)
        return np.where(own[..., None], start.rgb, way(start, sight))

    return shown


WAYS: Mapping[str, Callable[[Start, Sight], Picture]] = {
    "frozen": frozen,
    **{
        name: _with_own_car(way)
        for name, way in {
            "photo": drawn,
            "photo, traffic flows": flows,
            "homography": homography,
            "plane and backdrop": before_backdrop,
            "pop-up": popped_up,
        }.items()
    },
}
