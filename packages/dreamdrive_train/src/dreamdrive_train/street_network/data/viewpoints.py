"""Viewpoints of training pictures of drawn streets: where, when, and through which lens."""

from dataclasses import dataclass

import numpy as np
import shapely
from jaxtyping import Float

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import Ego, Lens, TrackPoint, track_function
from streetworld import Mover, World
from streetworld.edition2.layouts.held_back import Looks
from streetworld.engine.lens import level_from_camera, most_barrel, pinhole

_SIZES = ((512, 288), (512, 320), (512, 384), (512, 270), (512, 156))
"""16:9, 16:10, 4:3, 1.9:1 and 3.3:1, the shapes of usual recordings."""
_SIZE_SHARE = (0.4, 0.1, 0.25, 0.15, 0.1)
_USUAL_HFOV, _ANY_HFOV = np.deg2rad((45, 100)), np.deg2rad((30, 120))
_PITCH, _ROLL = np.deg2rad((2.0, 12.0)), np.deg2rad((0.5, 5.0))
_HEIGHT_M, _USUAL_HEIGHT_M = (0.8, 3.0), (1.1, 1.7)
_CAMERA_AHEAD = 0.13  # of a car's length from its middle to the camera behind its windscreen
_KERB_M = 9.0
_OFF_STREET_M = 1.5
_LEAST_STREET = 0.06
_TRIES, _TRIES_AT_ONCE = 60, 12
_COARSE = (32, 18)


@dataclass(frozen=True)
class Viewpoint:
    """A camera in the map frame at a time; ``ego`` is its place as that of a car."""

    time_s: float
    camera: Camera
    lens: Lens
    ego: Ego


def draw_lens(rng: np.random.Generator, looks: Looks, size: tuple[int, int], *, ahead: bool) -> Lens:
    """A lens of any recording: from tele to wide, a little tilted, some with a barrel or cushion."""
    usual = rng.random() < 0.85
    hfov = float(np.exp(rng.uniform(*np.log(_USUAL_HFOV if usual else _ANY_HFOV))))
    plain = Lens(hfov_rad=hfov)
    bend = rng.uniform(-0.8, 0.35) * -most_barrel(pinhole(plain, size)) if rng.random() < 0.35 else 0.0
    return Lens(
        hfov_rad=hfov,
        pitch_rad=_angle(rng, *_PITCH),
        roll_rad=_angle(rng, *_ROLL),
        distortion=float(np.clip(bend, -0.5, 0.5)),
        bonnet=looks.draw() if ahead and rng.random() < 1 / 3 else None,
    )


def _angle(rng: np.random.Generator, usual_rad: float, most_rad: float) -> float:
    """Mostly small."""
    if rng.random() < 0.8:
        return float(np.clip(rng.normal(0, usual_rad), -most_rad, most_rad))
    return float(rng.uniform(-most_rad, most_rad))


class Viewpoints:
    """Draws viewpoints of a world: from the recording car, from other cars' seats, from the kerb."""

    def __init__(self, world: World, rng: np.random.Generator, looks: Looks, seconds: float) -> None:
        self._world, self._rng, self._looks, self._seconds = world, rng, looks, seconds
        layout = world.layout
        firm = [shapely.Polygon(house.polygon).buffer(0.8) for house in layout.buildings]
        firm += [shapely.LineString(b.points).buffer(0.6) for b in layout.barriers]
        firm += [shapely.Point(p.at_m).buffer(1.2 if p.kind == "tree" else 0.7) for p in layout.props]
        self._firm = shapely.STRtree(firm)
        street = [shapely.Polygon(area.polygon, area.holes) for area in layout.areas if area.kind != "grass"]
        self._street = shapely.union_all(street)
        shapely.prepare(self._street)
        self._seats = [m for m in world.movers if m.moving and m.box.kind in ("car", "van", "truck", "bus")]
        self.move_on()

    def move_on(self) -> None:
        """Choose another time, and of the moving cars one to sit in, which is then left out."""
        self._time_s = float(self._rng.uniform(0, self._seconds))
        self.seat = self._near_seat() if self._seats else None
        self.moment = self._world.at(self._time_s, without=self.seat.instance if self.seat else 0)

    def draw(self) -> Viewpoint:
        """A viewpoint at that time that shows something."""
        for tries in range(_TRIES):
            if tries and tries % _TRIES_AT_ONCE == 0:
                self.move_on()
            found = self._draw()
            if found is not None and self._open(found.camera):
                return found
        raise RuntimeError("a drawn street has no place for a camera")

    def _draw(self) -> Viewpoint | None:
        rng, t_s, mover = self._rng, self._time_s, self.seat
        draw = rng.random()
        height = float(rng.uniform(*(_USUAL_HEIGHT_M if rng.random() < 0.7 else _HEIGHT_M)))
        if draw < 0.35 or (draw < 0.7 and mover is None):
            place = track_function(self._world.layout.ego.track)(np.array([t_s]))[0]
        elif draw < 0.7 and mover is not None:
            length, _, tall = mover.box.size_m
            place = mover.places(np.array([t_s]))[0]
            place[:2] += _CAMERA_AHEAD * length * np.array([np.cos(place[2]), np.sin(place[2])])
            height = float(np.clip(rng.uniform(0.68, 0.9) * tall, *_HEIGHT_M))
        else:
            place = self._beside()
        if not self._free(place):
            return None
        ahead = rng.random() < 2 / 3
        size = _SIZES[int(rng.choice(len(_SIZES), p=_SIZE_SHARE))]
        lens = draw_lens(rng, self._looks, size, ahead=ahead and draw < 0.7)
        turn = float(rng.normal(0, 0.04)) if ahead else float(rng.uniform(-np.pi, np.pi))
        pose = self._pose(place, turn, height, lens, plumb=draw >= 0.7)
        track = [TrackPoint(0.0, float(place[0]), float(place[1]), float(place[2]))]
        return Viewpoint(t_s, pinhole(lens, size).at(pose), lens, Ego(track, height))

    def _near_seat(self) -> Mover:
        """One of the moving cars, rather a near one than a far one."""
        rng, time = self._rng, np.array([self._time_s])
        here = track_function(self._world.layout.ego.track)(time)[0]
        places = np.array([m.places(time)[0] for m in self._seats])
        weight = np.exp(-np.linalg.norm(places[:, :2] - here[:2], axis=1) / 20.0) + 1e-9
        return self._seats[int(rng.choice(len(self._seats), p=weight / weight.sum()))]

    def _beside(self) -> Float[np.ndarray, "3"]:
        """Anywhere across the road and its sidewalks, looking along it or back."""
        rng = self._rng
        x, y, yaw = track_function(self._world.layout.ego.track)(np.array([self._time_s]))[0]
        left, along = float(rng.uniform(-_KERB_M, _KERB_M)), float(rng.uniform(-8, 25))
        x, y = x + along * np.cos(yaw) - left * np.sin(yaw), y + along * np.sin(yaw) + left * np.cos(yaw)
        return np.array([x, y, yaw + np.pi * (rng.random() < 0.4)])

    def _free(self, place: np.ndarray) -> bool:
        """Whether nothing else stands there."""
        here = shapely.Point(place[:2])
        if len(self._firm.query(here, predicate="intersects")) or not shapely.dwithin(
            self._street, here, _OFF_STREET_M
        ):
            return False
        for mover in self._world.movers:
            if mover is self.seat:
                continue
            x, y, yaw = mover.places(np.array([self._time_s]))[0]
            cos, sin = np.cos(yaw), np.sin(yaw)
            dx, dy = place[0] - x, place[1] - y
            length, width, _ = mover.box.size_m
            if abs(cos * dx + sin * dy) < 0.5 * length + 1.0 and abs(cos * dy - sin * dx) < 0.5 * width + 0.8:
                return False
        return True

    def _pose(
        self, place: np.ndarray, turn_rad: float, height_m: float, lens: Lens, *, plumb: bool
    ) -> Float[np.ndarray, "4 4"]:
        """``map_from_camera``; the height is that over the road below, along the plumb line."""
        pose = self._world.hills.laid(upright(place), plumb=plumb)
        pose[:3, :3] = pose[:3, :3] @ upright((0, 0, turn_rad))[:3, :3] @ level_from_camera(lens)
        pose[2, 3] += height_m
        return pose

    def _open(self, camera: Camera) -> bool:
        """Whether the picture shows some street, and is neither blocked nor almost all sky."""
        small = camera.resized(*_COARSE)
        rays = small.rays().reshape(-1, 3) @ camera.world_from_camera[:3, :3].T
        centre = camera.world_from_camera[:3, 3]
        depth = np.minimum(
            self._world.standing.first_hits(centre, rays).distance,
            self.moment.moving.first_hits(centre, rays).distance,
        )
        seen = np.isfinite(depth)
        points = centre + depth[seen, None] * rays[seen]
        low = np.abs(points[:, 2] - self._world.hills.height_m(points[:, :2])) < 0.3
        street = (shapely.contains_xy(self._street, points[:, :2]) & low).sum() / len(depth)
        sky, close, near = np.isinf(depth).mean(), (depth < 1.6).mean(), (depth < 5.0).mean()
        return bool(street > _LEAST_STREET and sky < 0.72 and close < 0.2 and near < 0.6)
