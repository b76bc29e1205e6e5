"""What stands and moves in the procedural street, in street coordinates.

Street frame: x right of the middle of the road, y down with the asphalt at 0, z along the road.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.data import street_textures as paint
from dreamdrive.data.street_raycast import Solid
from dreamdrive.data.street_textures import Texture

_LANE_M = 1.75
_KERB_M = 6.0
_FRONT_M = 9.0
_BEHIND_M = 25.0
_BEYOND_M = 85.0


@dataclass(frozen=True)
class Motion:
    """Where a thing is over time: constant speed along its heading, with a slow sway.

    Attributes:
        start_m: Centre of its footprint (x, z) at time 0.
        speed_m_s: Speed along its heading; 0 for parked.
        yaw_rad: Heading about the up axis, 0 along +z, positive to the right.
        sway_m: Amplitude of the sideways sway.
        phase_rad: Phase of the sway.
    """

    start_m: tuple[float, float]
    speed_m_s: float = 0.0
    yaw_rad: float = 0.0
    sway_m: float = 0.0
    phase_rad: float = 0.0

    def pose(self, t_s: float) -> Float[np.ndarray, "4 4"]:
        """``street_from_thing`` (4, 4): the origin on the ground, z along the heading."""
        rate = 1.3
        sway = self.sway_m * np.sin(rate * t_s + self.phase_rad)
        slope = self.sway_m * rate * np.cos(rate * t_s + self.phase_rad) / max(self.speed_m_s, 1.0)
        turn, base = self.yaw_rad + slope, self.yaw_rad
        distance = self.speed_m_s * t_s
        pose = np.eye(4)
        pose[:3, :3] = [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
        pose[0, 3] = self.start_m[0] + distance * np.sin(base) + sway * np.cos(base)
        pose[2, 3] = self.start_m[1] + distance * np.cos(base) - sway * np.sin(base)
        return pose


@dataclass(frozen=True)
class Part:
    """One box of a thing, relative to the thing's origin on the ground.

    Attributes:
        centre_m: Centre (x, y, z).
        size_m: Size (x, y, z).
        textures: Of the faces -x, +x, -y (up), +y, -z, +z.
        shadow: Whether it darkens the ground around it.
    """

    centre_m: tuple[float, float, float]
    size_m: tuple[float, float, float]
    textures: tuple[Texture, ...]
    shadow: bool = False


@dataclass(frozen=True)
class Thing:
    """Parts that share one motion and one label.

    Attributes:
        kind: ``"car"``, ``"van"``, ``"cyclist"``, or ``"backdrop"``.
        instance: Label of its pixels; 0 for the backdrop.
        size_m: Width, height and length of its hull (3,).
        motion: Where it is.
        parts: Its boxes.
    """

    kind: str
    instance: int
    size_m: tuple[float, float, float]
    motion: Motion
    parts: tuple[Part, ...]

    def solids(self, t_s: float) -> list[Solid]:
        """Its boxes at a time."""
        pose = self.motion.pose(t_s)
        return [_solid(part, pose, self.instance) for part in self.parts]


def _solid(part: Part, pose: np.ndarray, instance: int) -> Solid:
    moved = pose.copy()
    moved[:3, 3] += pose[:3, :3] @ np.array(part.centre_m)
    return Solid(np.array(part.size_m) / 2, moved, part.textures, instance, part.shadow)


def ego_pose(
    t_s: float, speed_m_s: float, camera_height_m: float, phases: Float[np.ndarray, "4"]
) -> Float[np.ndarray, "4 4"]:
    """``street_from_camera`` of the recording car: its lane with a mild sway, nod and roll."""
    sway_m, rate = 0.22, 1.1
    x = _LANE_M + sway_m * np.sin(rate * t_s + phases[0])
    yaw = np.arctan2(sway_m * rate * np.cos(rate * t_s + phases[0]), max(speed_m_s, 1.0))
    z = speed_m_s * t_s + 0.15 * (np.sin(0.9 * t_s + phases[1]) - np.sin(phases[1]))
    pitch = np.deg2rad(0.35) * np.sin(4.1 * t_s + phases[2])
    roll = np.deg2rad(0.25) * np.sin(2.3 * t_s + phases[3])
    about_y = [[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]]
    about_x = [[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]]
    about_z = [[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]]
    pose = np.eye(4)
    pose[:3, :3] = np.array(about_y) @ np.array(about_x) @ np.array(about_z)
    pose[:3, 3] = x, -camera_height_m + 0.012 * np.sin(4.1 * t_s + phases[2]), z
    return pose


def backdrop(rng: np.random.Generator, drive_m: float) -> Thing:
    """Road (always the first part), sidewalks, houses, posts and kiosks along a drive of some length."""
    start, end = -_BEHIND_M, drive_m + _BEYOND_M
    length, middle = end - start, (start + end) / 2
    texel = max(0.025, length / 12000)
    asphalt = paint.road(rng, 2 * _KERB_M, length, texel)
    parts = [Part((0, 0.5, middle), (2 * _KERB_M, 1.0, length), (asphalt,) * 6)]
    for side in (-1, 1):
        slabs = paint.paving(rng, 6.0, length, 2 * texel)
        kerb = paint.plain(rng, length, 0.15, (176, 172, 164), 0.05)
        walk = (kerb, kerb, slabs, kerb, kerb, kerb)
        parts.append(Part((side * (_KERB_M + 3.0), 0.43, middle), (6.0, 1.14, length), walk))
        parts.extend(_houses(rng, side, start, end))
        parts.extend(_furniture(rng, side, end))
    far = paint.facade(rng, 44.0, 17.0, 0.06)
    parts.append(Part((0, -8.5, end + 4), (44.0, 17.0, 8.0), (far,) * 6))
    return Thing("backdrop", 0, (44.0, 17.0, length), Motion((0.0, 0.0)), tuple(parts))


def _houses(rng: np.random.Generator, side: int, start: float, end: float) -> list[Part]:
    parts: list[Part] = []
    z = start
    while z < end:
        width, height = float(rng.uniform(7.5, 14)), float(rng.uniform(7, 15))
        front, depth = _FRONT_M + float(rng.uniform(0, 1.4)), 9.0
        face = paint.facade(rng, width, height)
        flank = paint.plain(rng, depth, height, (150, 140, 128))
        faces = (face, face, flank, flank, flank, flank)
        centre = (side * (front + depth / 2), -height / 2, z + width / 2)
        parts.append(Part(centre, (depth, height, width), faces))
        z += width
    return parts


def _furniture(rng: np.random.Generator, side: int, end: float) -> list[Part]:
    """Lamp posts with a board, and kiosks full of posters."""
    parts: list[Part] = []
    for z in np.arange(rng.uniform(4, 10), end, 13.0):
        tone = rng.integers(60, 110, 3)
        steel = paint.plain(rng, 0.16, 6.0, (int(tone[0]), int(tone[1]), int(tone[2])), 0.02)
        x = side * (_KERB_M + 0.5)
        parts.append(Part((x, -3.0, float(z)), (0.16, 6.0, 0.16), (steel,) * 6))
        board = paint.facade(rng, 4.0, 4.5, 0.05)
        parts.append(Part((x, -2.7, float(z) - 0.12), (0.75, 0.8, 0.04), (board,) * 6))
    for z in np.arange(rng.uniform(12, 20), end, 21.0):
        posters = paint.facade(rng, 5.0, 6.0, 0.04)
        parts.append(Part((side * (_KERB_M + 1.6), -1.2, float(z)), (1.0, 2.3, 1.6), (posters,) * 6))
    return parts


def _vehicle(rng: np.random.Generator, kind: str, instance: int, motion: Motion) -> Thing:
    colour = paint.vehicle_paint(rng)
    width, height, length = {"car": (1.8, 1.46, 4.3), "van": (2.0, 2.35, 5.4)}[kind]
    body_m = 0.88 if kind == "car" else height
    side = paint.vehicle_side(rng, length, body_m, colour)
    back = paint.vehicle_end(rng, width, body_m, colour, (190, 24, 30))
    front = paint.vehicle_end(rng, width, body_m, colour, (238, 236, 214))
    top = paint.plain(rng, width, length, colour, 0.03)
    parts = [
        Part((0, -body_m / 2, 0), (width, body_m, length), (side, side, top, top, back, front), shadow=True)
    ]
    if kind == "car":
        glass = paint.vehicle_glass(rng, 2.2, height - body_m)
        end = paint.vehicle_glass(rng, 1.5, height - body_m)
        cabin = (glass, glass, top, top, end, end)
        parts.append(Part((0, -(body_m + height) / 2, -0.25), (1.56, height - body_m, 2.3), cabin))
    return Thing(kind, instance, (width, height, length), motion, tuple(parts))


def _cyclist(rng: np.random.Generator, instance: int, motion: Motion) -> Thing:
    colour = paint.vehicle_paint(rng)
    wheels = paint.vehicle_side(rng, 1.75, 0.75, (120, 122, 126), 0.012)
    coat = paint.vehicle_end(rng, 0.5, 0.9, colour, (240, 200, 60), 0.012)
    parts = (
        Part((0, -0.375, 0), (0.16, 0.75, 1.75), (wheels,) * 6, shadow=True),
        Part((0, -1.2, 0), (0.5, 0.9, 0.6), (coat,) * 6),
    )
    return Thing("cyclist", instance, (0.5, 1.65, 1.75), motion, parts)


def parked_vehicles(rng: np.random.Generator, count: int, first_instance: int) -> list[Thing]:
    """Cars and vans at both kerbs, alternating, about ten metres apart on each side."""
    next_z = {1: float(rng.uniform(7, 10)), -1: float(rng.uniform(11, 15))}
    things: list[Thing] = []
    for i in range(count):
        side = 1 if i % 2 == 0 else -1
        kind = "van" if rng.random() < 0.25 else "car"
        yaw = (0.0 if side > 0 else np.pi) + float(rng.normal(0, 0.015))
        motion = Motion((side * (4.85 + float(rng.uniform(-0.1, 0.1))), next_z[side]), yaw_rad=yaw)
        things.append(_vehicle(rng, kind, first_instance + i, motion))
        next_z[side] += float(rng.uniform(7.5, 13))
    return things


def moving_things(rng: np.random.Generator, count: int, speed_m_s: float, first_instance: int) -> list[Thing]:
    """A car ahead in the lane, an oncoming one, a cyclist, an oncoming van; more of the same further away."""
    things: list[Thing] = []
    for i in range(count):
        far, phase, instance = 30.0 * (i // 4), float(rng.uniform(0, 2 * np.pi)), first_instance + i
        if i % 4 == 0:
            motion = Motion((_LANE_M, 11.0 + far), speed_m_s + 1.0, sway_m=0.2, phase_rad=phase)
            things.append(_vehicle(rng, "car", instance, motion))
        elif i % 4 == 2:
            motion = Motion((3.3, 13.0 + far), 4.5, sway_m=0.12, phase_rad=phase)
            things.append(_cyclist(rng, instance, motion))
        else:
            start, kind = (42.0, "car") if i % 4 == 1 else (68.0, "van")
            motion = Motion((-_LANE_M, start + far), speed_m_s, np.pi, sway_m=0.1, phase_rad=phase)
            things.append(_vehicle(rng, kind, instance, motion))
    return things
