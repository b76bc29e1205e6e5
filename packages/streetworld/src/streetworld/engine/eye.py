"""Rendering of a camera by rays: to surfaces, on to the sun, with the truth behind each pixel."""

import numpy as np

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.truth import Semantic
from streetworld.engine.columns import by_columns, dot, outer, picked, turned
from streetworld.engine.lens import bent, unbent
from streetworld.engine.solid import Hits
from streetworld.engine.street import Moment, Street
from streetworld.engine.view import WorldView

_FLATTEST = 0.03
_NEAR_M = 0.05
_WIDEST = 10.0
_GROUND_MIRRORED = np.array([0.12, 0.12, 0.12], np.float32)


class Eye:
    """A camera in a world at a time."""

    def __init__(self, world: Street, moment: Moment, camera: Camera) -> None:
        self.world, self.moment, self.camera = world, moment, camera
        self.centre = camera.world_from_camera[:3, 3]
        self.standing = len(world.standing)
        self._window = self._reach()

    @property
    def k1(self) -> float:
        """Distortion of the lens; that of a pinhole is 0."""
        return 0.0

    def _reach(self) -> tuple[float, float, float, float]:
        """First and last column and row on which a mover can lie."""
        c, corners = self.camera, self.moment.moving.corners
        local = turned(corners.reshape(-1, 3) - self.centre, c.world_from_camera[:3, :3].T)
        ahead = local[:, 2] > _NEAR_M
        part = ahead.reshape(-1, 3)
        if self.k1 or (part.any(axis=1) & ~part.all(axis=1)).any():
            return 0.0, float(c.width_px), 0.0, float(c.height_px)
        if not ahead.any():
            return 0.0, -1.0, 0.0, -1.0
        x, y, z = local[ahead].T
        columns, rows = x / z * c.fx_px + c.cx_px, y / z * c.fy_px + c.cy_px
        return float(columns.min()), float(columns.max()), float(rows.min()), float(rows.max())

    def rays(self, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Directions (N, 3) in the map frame, of length 1 along z."""
        c = self.camera
        plane = [(columns - c.cx_px) / c.fx_px, (rows - c.cy_px) / c.fy_px]
        if self.k1:
            plane = list(unbent(np.stack(plane, axis=-1), self.k1).T)
        return turned(by_columns([*plane, np.ones(len(columns))]), c.world_from_camera[:3, :3])

    def trace(self, rays: np.ndarray, columns: np.ndarray, rows: np.ndarray) -> Hits:
        """The first triangle on each ray; those of movers are counted on from the standing ones."""
        hits = self.world.standing.first_hits(self.centre, rays)
        left, right, top, bottom = self._window
        near = np.flatnonzero((columns >= left) & (columns <= right) & (rows >= top) & (rows <= bottom))
        moving = self.moment.moving.first_hits(self.centre, picked(rays, near))
        nearer = moving.distance < hits.distance[near]
        hits.triangle[near[nearer]] = moving.triangle[nearer] + self.standing
        hits.distance[near[nearer]] = moving.distance[nearer]
        return hits

    def behind_glass(self, colour: np.ndarray, hits: Hits) -> np.ndarray:
        """Linear colours (N, 3) of the whole picture as they come through the windscreen: here, unchanged."""
        del hits
        return colour

    def completed(self, view: WorldView) -> WorldView:
        """The picture and its truth with what is fixed to the camera: here, nothing."""
        return view

    def _gather(self, name: str, triangle: np.ndarray) -> np.ndarray:
        """A table's rows for triangles of both kinds."""
        still, moving = getattr(self.world.standing, name), getattr(self.moment.moving, name)
        first = triangle < self.standing
        if first.all():
            return picked(still, triangle)
        rows = picked(still, np.where(first, triangle, 0))
        second = np.flatnonzero(~first)
        rows[second] = picked(moving, triangle[second] - self.standing)
        return rows

    def instances(self, hits: Hits) -> np.ndarray:
        """Label of the box on each ray, 0 for none."""
        label = np.zeros(len(hits.triangle), dtype=np.int32)
        solid = np.flatnonzero(hits.triangle >= 0)
        owner = self._gather("owner", hits.triangle[solid])
        moving = hits.triangle[solid] >= self.standing
        label[solid] = owner
        label[solid[moving]] = self.world.part_instance[owner[moving]]
        return label

    def semantics(self, rays: np.ndarray, hits: Hits) -> np.ndarray:
        """Class on each ray."""
        label = np.full(len(hits.triangle), Semantic.SKY, dtype=np.uint8)
        solid = np.flatnonzero(hits.triangle >= 0)
        material = self._gather("material", hits.triangle[solid])
        label[solid] = np.array(self.world.materials.semantic)[material]
        ground = solid[material == self.world.made.ground_material]
        points = self.centre[:2] + hits.distance[ground, None] * rays[ground, :2]
        label[ground] = self.world.made.ground.labels_at(points)
        return label

    def flow(
        self,
        rays: np.ndarray,
        hits: Hits,
        columns: np.ndarray,
        rows: np.ndarray,
        following: tuple[float, Camera],
    ) -> np.ndarray:
        """Way (N, 2) in pixels of what is seen to its place in another picture; of the sky by direction."""
        t_s, camera = following
        solid = hits.triangle >= 0
        points = self.centre + np.where(solid, hits.distance, 1.0)[:, None] * rays
        moving = np.flatnonzero(hits.triangle >= self.standing)
        if len(moving):
            owner = self.moment.moving.owner[hits.triangle[moving] - self.standing]
            carry = self.world.poses(t_s) @ np.linalg.inv(self.moment.poses)
            points[moving] = (
                np.einsum("nij,nj->ni", carry[owner, :3, :3], points[moving]) + carry[owner, :3, 3]
            )
        # What is infinitely far away does not see the camera move, only turn.
        there = camera.world_from_camera[:3, 3]
        start = by_columns([np.where(solid, a, b) for a, b in zip(there, self.centre, strict=True)])
        local = turned(points - start, camera.world_from_camera[:3, :3].T)
        z = np.maximum(local[:, 2], 1e-6)
        if self.k1:
            # What lies beside or behind the camera would be bent beyond all numbers.
            local[:, :2] = z[:, None] * bent(np.clip(local[:, :2] / z[:, None], -_WIDEST, _WIDEST), self.k1)
        across = local[:, 0] / z * camera.fx_px + camera.cx_px - columns
        return np.stack([across, local[:, 1] / z * camera.fy_px + camera.cy_px - rows], axis=-1)

    def shade(self, rays: np.ndarray, hits: Hits) -> np.ndarray:
        """Linear colours (N, 3) on each ray."""
        sky = self.world.sky
        colour = np.empty((len(rays), 3), dtype=np.float32, order="F")
        solid = hits.triangle >= 0
        free, at = np.flatnonzero(~solid), np.flatnonzero(solid)
        colour[free] = sky.colour(picked(rays, free))
        if not len(at):
            return colour
        triangle, distance, along = hits.triangle[at], hits.distance[at], picked(rays, at)
        points = (self.centre + distance[:, None] * along).astype(np.float32)
        view = along.astype(np.float32)
        length = np.sqrt(dot(view, view))
        view /= length[:, None]
        distance_m = distance.astype(np.float32) * length
        normal = self._gather("normals", triangle)
        facing = dot(normal, view)
        normal *= -np.sign(facing)[:, None]  # a surface seen from behind shines as well
        slope = np.maximum(np.abs(facing), _FLATTEST)
        material = self._gather("material", triangle)
        albedo = self._albedo(triangle, material, points, view, normal, slope, distance_m)
        self._bend(triangle, points, view, normal, slope)
        light = self._light(points, normal, material)
        gloss = np.array(self.world.materials.gloss, np.float32)[material]
        mirrored = self._mirrored(view, normal, slope, gloss)
        near = np.exp(np.float32(-sky.haze_per_m) * distance_m)
        colour[at] = (albedo * light + mirrored) * near[:, None] + outer(1 - near, sky.haze)
        return colour

    def _albedo(
        self,
        triangle: np.ndarray,
        material: np.ndarray,
        points: np.ndarray,
        view: np.ndarray,
        normal: np.ndarray,
        slope: np.ndarray,
        distance_m: np.ndarray,
    ) -> np.ndarray:
        """Share of the light that surfaces throw back (N, 3): the mean over what the pixel covers."""
        rows = self._gather("to_uv", triangle)
        uv = by_columns([dot(rows[:, k, :3], points) + rows[:, k, 3] for k in (0, 1)])
        # A pixel covers an ellipse: the short axis across the line of sight, the long one along it.
        short_m = distance_m / np.float32(self.camera.fx_px)
        along = view + slope[:, None] * normal  # the line of sight on the surface; its length is the sine
        along *= (0.5 * short_m / slope / np.maximum(np.sqrt(dot(along, along)), 1e-6))[:, None]
        reach = by_columns([dot(rows[:, k, :3], along) for k in (0, 1)])
        width = np.maximum(short_m, short_m / slope / 6) * np.sqrt(dot(rows[:, 0, :3], rows[:, 0, :3]))
        index = np.array(self.world.materials.texture)[material]
        return (self.world.materials.textures.lookup(index, uv, reach, width) / 255) ** 2

    def _bend(
        self,
        triangle: np.ndarray,
        points: np.ndarray,
        view: np.ndarray,
        normal: np.ndarray,
        slope: np.ndarray,
    ) -> None:
        """Turn the normals of curved bodies to those between the corners of their triangles, in place."""
        for solid, first in ((self.world.standing, 0), (self.moment.moving, self.standing)):
            if solid.curved is None or solid.to_normal is None:
                continue
            mine = np.flatnonzero((triangle >= first) & (triangle < first + len(solid)))
            mine = mine[solid.curved[triangle[mine] - first]]
            rows, at = solid.to_normal[triangle[mine] - first], picked(points, mine)
            bent = by_columns([dot(rows[:, k, :3], at) + rows[:, k, 3] for k in range(3)])
            bent *= np.sign(dot(bent, picked(normal, mine)))[:, None]
            # One that leans away from the eye would mirror the inside of its body.
            along = picked(view, mine)
            bent -= np.maximum(dot(bent, along) + _FLATTEST, 0)[:, None] * along
            bent /= np.maximum(np.sqrt(dot(bent, bent)), 1e-6)[:, None]
            normal[mine] = bent
            slope[mine] = np.maximum(-dot(bent, along), _FLATTEST)

    def _light(self, points: np.ndarray, normal: np.ndarray, material: np.ndarray) -> np.ndarray:
        """Light that falls on surfaces (N, 3)."""
        sky = self.world.sky
        lit = dot(normal, sky.towards_sun.astype(np.float32)[None])
        sunny = np.flatnonzero(lit > 0)
        start = picked(points, sunny) + np.float32(1e-3) * picked(normal, sunny)
        hidden = self.world.standing.hidden(start, sky.towards_sun)
        hidden |= self.moment.moving.hidden(start, sky.towards_sun)
        sun = np.zeros(len(points), dtype=np.float32)
        sun[sunny] = lit[sunny] * ~hidden
        open_ = (0.62 + 0.38 * normal[:, 2]).astype(np.float32)
        ground = np.flatnonzero(material == self.world.made.ground_material)
        open_[ground] *= self._under_bodies(picked(points, ground))
        return outer(sun, sky.sunlight) + outer(open_, sky.skylight)

    def _under_bodies(self, points: np.ndarray) -> np.ndarray:
        """Share of the sky's light that reaches the ground beside and below road users."""
        share = np.ones(len(points), dtype=np.float32)
        x, y = points[:, 0], points[:, 1]
        for mover in self.world.movers:
            pose = mover.pose(self.moment.time_s).astype(np.float32)
            length, width, _ = mover.box.size_m
            reach = 0.5 * length + 0.8
            close = np.flatnonzero((np.abs(x - pose[0, 3]) < reach) & (np.abs(y - pose[1, 3]) < reach))
            if not len(close):
                continue
            local = np.abs(turned(picked(points[:, :2], close) - pose[:2, 3], pose[:2, :2].T))
            outside = np.maximum(local - np.array([0.45 * length, 0.42 * width], np.float32), 0)
            share[close] *= 1 - np.float32(0.75) * np.exp(-dot(outside, outside) / np.float32(0.35**2))
        return share

    def _mirrored(
        self, view: np.ndarray, normal: np.ndarray, slope: np.ndarray, gloss: np.ndarray
    ) -> np.ndarray:
        """Light of the sky that smooth surfaces mirror (N, 3), by Schlick's approximation."""
        mirrored = np.zeros((len(view), 3), dtype=np.float32, order="F")
        smooth = np.flatnonzero(gloss > 0)
        if len(smooth):
            v, n = picked(view, smooth), picked(normal, smooth)
            back = v - 2 * dot(v, n)[:, None] * n
            share = gloss[smooth] + (1 - gloss[smooth]) * (1 - slope[smooth]) ** 5
            seen = self.world.sky.colour(back)
            seen[back[:, 2] < 0] = _GROUND_MIRRORED
            mirrored[smooth] = np.minimum(seen, 1.5) * share[:, None]
        return mirrored
