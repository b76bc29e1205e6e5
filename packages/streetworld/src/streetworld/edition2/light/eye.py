"""Lighting of what a camera sees: lamps at night, wet roads that mirror, what is on the glass."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import track_function
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.light import glass
from streetworld.edition2.light.lamps import Lamps, headlights
from streetworld.edition2.standing import Standing2
from streetworld.engine.columns import by_columns, dot, outer, picked, turned
from streetworld.engine.eye import Eye
from streetworld.engine.lens import bent
from streetworld.engine.solid import Hits
from streetworld.engine.view import WorldView

_DETAIL_M = 2.4
"""Side of the tile that makes near ground grainy."""
_DETAIL_REACH_M = 16.0
_HEADLIGHT = 330.0
_EGO_SIZE = (2.6, 1.8, 1.5)  # the camera sits behind the bonnet
_LAMP_KINDS = ("car", "van", "truck", "bus", "motorcycle")


class Eye2(Eye):
    """A camera in a street of edition 2 at a time."""

    @property
    def k1(self) -> float:
        """Distortion of the layout's lens."""
        return self.world.layout.lens.distortion

    @property
    def made(self) -> Standing2:
        """What edition 2 made of the layout."""
        assert isinstance(self.world.made, Standing2)
        return self.world.made

    @cached_property
    def lamps(self) -> Lamps:
        """What shines at this time near the camera."""
        night = self.world.layout.light.night
        if night < 0.05:
            return Lamps.street([], [])
        t_s = self.moment.time_s
        place = track_function(self.world.layout.ego.track)(np.array([t_s]))[0]
        ego = self.world.hills.laid(upright(place))
        cars = [(ego, _EGO_SIZE)]
        cars += [
            (m.pose(t_s), m.box.size_m) for m in self.world.movers if m.moving and m.box.kind in _LAMP_KINDS
        ]
        beams = headlights(cars, self.world.layout.seed, _HEADLIGHT * night**2)
        return (self.made.lamps + beams).nearest(self.centre)

    def semantics(self, rays: np.ndarray, hits: Hits) -> np.ndarray:
        """Class on each ray."""
        label = super().semantics(rays, hits)
        solid = np.flatnonzero(hits.triangle >= 0)
        far = solid[self._gather("material", hits.triangle[solid]) == self.made.far_material]
        points = self.centre[:2] + hits.distance[far, None] * rays[far, :2]
        label[far] = self.made.ground.labels_at(points)
        return label

    def shade(self, rays: np.ndarray, hits: Hits) -> np.ndarray:
        """Linear colours (N, 3) on each ray."""
        sky, light = self.world.sky, self.world.layout.light
        colour = np.empty((len(rays), 3), dtype=np.float32, order="F")
        solid = hits.triangle >= 0
        free, at = np.flatnonzero(~solid), np.flatnonzero(solid)
        colour[free] = sky.colour(picked(rays, free))
        if not len(at):
            return colour
        distance, view = hits.distance[at], picked(rays, at).astype(np.float32)
        points = (self.centre + distance[:, None] * picked(rays, at)).astype(np.float32)
        length = np.sqrt(dot(view, view))
        view /= length[:, None]
        distance_m = distance.astype(np.float32) * length
        seen, normal, slope, material = self._surface(hits.triangle[at], points, view, distance_m)
        if light.wet > 0:
            self._wet(seen, points, view, normal, slope, material, distance_m)
        near = np.exp(np.float32(-sky.haze_per_m) * distance_m)
        colour[at] = seen * near[:, None] + outer(1 - near, sky.haze)
        return colour

    def _surface(
        self,
        triangle: np.ndarray,
        points: np.ndarray,
        view: np.ndarray,
        distance_m: np.ndarray,
        *,
        shadows: bool = True,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Colours (N, 3) of surfaces, their normals, the cosines they are seen under, their materials."""
        normal = self._gather("normals", triangle)
        facing = dot(normal, view)
        normal *= -np.sign(facing)[:, None]  # a surface seen from behind shines as well
        slope = np.maximum(np.abs(facing), np.float32(0.03))
        material = self._gather("material", triangle)
        albedo = self._albedo(triangle, material, points, view, normal, slope, distance_m)
        self._bend(triangle, points, view, normal, slope)
        self._detail(albedo, material, points, view, slope, distance_m)
        gloss = np.array(self.world.materials.gloss, np.float32)[material]
        lit = self._light(points, normal, material) if shadows else self._ambient(points, normal)
        seen = albedo * lit + self._mirrored(view, normal, slope, gloss)
        self._add_glow(seen, triangle, material, points, view, normal, slope, distance_m)
        return seen, normal, slope, material

    def _light(self, points: np.ndarray, normal: np.ndarray, material: np.ndarray) -> np.ndarray:
        """Light that falls on surfaces (N, 3): sun, sky and lamps; walls are darker at their foot."""
        light = super()._light(points, normal, material)
        upright_ = np.flatnonzero(np.abs(normal[:, 2]) < 0.5)
        here = picked(points, upright_)
        high = here[:, 2] - self.world.hills.height_m(here[:, :2])
        light[upright_] *= (1 - 0.3 * np.exp(-np.maximum(high, 0) / 1.2)).astype(np.float32)[:, None]
        if len(self.lamps):
            light += self.lamps.light(points, normal)
        return light

    def _ambient(self, points: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Light on what is seen in a mirror only: without shadows."""
        sky = self.world.sky
        sun = np.maximum(dot(normal, sky.towards_sun.astype(np.float32)[None]), 0)
        light = outer(0.7 * sun, sky.sunlight) + outer(0.62 + 0.38 * normal[:, 2], sky.skylight)
        return light + self.lamps.light(points, normal) if len(self.lamps) else light

    def _ground(self, material: np.ndarray) -> np.ndarray:
        return np.flatnonzero((material == self.made.ground_material) | (material == self.made.far_material))

    def _detail(
        self,
        albedo: np.ndarray,
        material: np.ndarray,
        points: np.ndarray,
        view: np.ndarray,
        slope: np.ndarray,
        distance_m: np.ndarray,
    ) -> None:
        """Grain of near ground, finer than its picture, in place."""
        ground = self._ground(material)
        near = ground[distance_m[ground] < _DETAIL_REACH_M]
        if not len(near):
            return
        uv = (picked(points[:, :2], near) / np.float32(_DETAIL_M)).astype(np.float32)
        short = distance_m[near] / np.float32(self.camera.fx_px * _DETAIL_M)
        flat = picked(view[:, :2], near)
        flat = flat / np.maximum(np.sqrt(dot(flat, flat)), 1e-6)[:, None]
        along = flat * (0.5 * short / slope[near])[:, None]
        index = np.full(len(near), self.made.detail_texture)
        grain = self.world.materials.textures.lookup(index, uv, along, short) / np.float32(128)
        fade = np.clip(2 - 2 * distance_m[near] / np.float32(_DETAIL_REACH_M), 0, 1)[:, None]
        albedo[near] *= (1 + fade * (grain - 1)) ** 2

    def _add_glow(
        self,
        seen: np.ndarray,
        triangle: np.ndarray,
        material: np.ndarray,
        points: np.ndarray,
        view: np.ndarray,
        normal: np.ndarray,
        slope: np.ndarray,
        distance_m: np.ndarray,
    ) -> None:
        """What shines of itself, in place: windows and lamps, the more the darker it is."""
        night = self.world.layout.light.night
        glow = np.array(self.world.materials.glow, np.int64)[material]
        shining = np.flatnonzero(glow >= 0)
        if night < 0.05 or not len(shining):
            return
        rows = self._gather("to_uv", triangle[shining])
        here = picked(points, shining)
        uv = by_columns([dot(rows[:, k, :3], here) + rows[:, k, 3] for k in (0, 1)])
        across = np.sqrt(dot(rows[:, 0, :3], rows[:, 0, :3]))
        width = distance_m[shining] / np.float32(self.camera.fx_px) / np.sqrt(slope[shining]) * across
        none = np.zeros_like(uv)
        light = self.world.materials.textures.lookup(glow[shining], uv, none, width) / np.float32(255)
        seen[shining] += light**2 * np.float32(1.6 * night)

    def _wet(
        self,
        seen: np.ndarray,
        points: np.ndarray,
        view: np.ndarray,
        normal: np.ndarray,
        slope: np.ndarray,
        material: np.ndarray,
        distance_m: np.ndarray,
    ) -> None:
        """Wet ground is darker and mirrors what stands on it, in place."""
        level = self.world.layout.light.wet
        ground = self._ground(material)
        here = picked(points, ground)
        wet = level * self.made.ground.wetness(here[:, :2], level)
        wet *= np.where(self.made.ground.labels_at(here[:, :2]) == Semantic.GRASS, 0.3, 1).astype(np.float32)
        seen[ground] *= (1 - 0.45 * wet)[:, None]
        share = wet * (0.02 + 0.98 * (1 - slope[ground]) ** 5)
        mirrors = np.flatnonzero(share > 0.03)
        if not len(mirrors):
            return
        at, rough = ground[mirrors], 0.05 * (1 - wet[mirrors])[:, None] + 0.012
        rng = np.random.default_rng(len(mirrors))
        n = picked(normal, at) + rough * rng.standard_normal((len(at), 3), dtype=np.float32) * [0.5, 0.5, 0.2]
        v = picked(view, at)
        back = np.asfortranarray(v - 2 * dot(v, n)[:, None] * n, dtype=np.float32)
        back[:, 2] = np.maximum(back[:, 2], 0.004)
        mirrored = self._seen_from(picked(points, at), back, distance_m[at])
        seen[at] += mirrored * share[mirrors][:, None]

    def _seen_from(self, points: np.ndarray, rays: np.ndarray, before_m: np.ndarray) -> np.ndarray:
        """Colours (N, 3) along rays from points, without further mirrors; ``before_m`` is the way so far."""
        hits = self.world.standing.first_from(points, rays)
        moving = self.moment.moving.first_from(points, rays)
        nearer = moving.distance < hits.distance
        triangle = np.where(nearer, moving.triangle + self.standing, hits.triangle)
        distance = np.where(nearer, moving.distance, hits.distance)
        colour = np.minimum(self.world.sky.colour(rays), 1.5)
        at = np.flatnonzero(triangle >= 0)
        if len(at):
            view, far = picked(rays, at), distance[at].astype(np.float32)
            length = np.sqrt(dot(view, view))
            there = picked(points, at) + far[:, None] * view
            view = view / length[:, None]
            way = far * length + before_m[at]
            colour[at] = self._surface(triangle[at], there, view, way, shadows=False)[0]
        return colour

    def camera_px(self, local: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Column and row of points of the camera's frame; what lies behind has no sense."""
        c = self.camera
        z = np.where(np.abs(local[:, 2:]) > 1e-6, local[:, 2:], 1e-6)
        plane = bent(local[:, :2] / z, self.k1) if self.k1 else local[:, :2] / z
        return plane * [c.fx_px, c.fy_px] + [c.cx_px, c.cy_px]

    def behind_glass(self, colour: np.ndarray, hits: Hits) -> np.ndarray:
        """The whole picture as it comes through haloes, rain and the windscreen."""
        sky, light, seed = self.world.sky, self.world.layout.light, self.world.layout.seed
        shape = self.camera.height_px, self.camera.width_px
        image = np.ascontiguousarray(colour.reshape(*shape, 3), dtype=np.float32)
        rng = np.random.default_rng([seed, 44])
        if light.night > 0.05:
            depth = np.where(hits.triangle >= 0, hits.distance, np.inf).reshape(shape)
            at, shine = self._shining()
            local = turned(at - self.centre, self.camera.world_from_camera[:3, :3].T)
            places = self.camera_px(local)
            image += glass.haloes(places, local[:, 2], light.night * shine, self.camera.fx_px, depth, rng)
        image = image + glass.bloom(image, 0.02 + 0.1 * light.night + 0.05 * light.rain)
        if light.rain > 0 or light.snow > 0.5:
            moment = np.random.default_rng([seed, 43, round(100 * abs(self.moment.time_s))])
            flakes = float(np.clip(2 * light.snow - 1, 0, 1)) * (light.rain == 0)
            image = glass.falling(moment, image, light.rain, flakes)
        if self.bonnet is not None:
            above = sky.skylight + 0.6 * sky.sunlight * sky.towards_sun[2]
            image = self.bonnet.drawn(image, self._horizon_row(), above.astype(np.float32) + 0.01)
        if light.rain > 0:
            image = glass.drops(rng, image, light.rain)
        veil = light.glare * rng.uniform(0.1, 0.45) + rng.exponential(0.008)
        return glass.screen(rng, image, veil).reshape(-1, 3)

    def _horizon_row(self) -> float:
        """Row of the horizon in the middle of the picture."""
        ahead = self.camera.world_from_camera[:3, 2]
        return float(self.camera.cy_px + ahead[2] / max(np.hypot(*ahead[:2]), 1e-3) * self.camera.fy_px)

    def _shining(self) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
        """Places and colours of what shines into the camera: street lamps, head and tail lights."""
        lamps = self.made.lamps
        at = list(lamps.at_m)
        colour = [c / max(float(c.max()), 1e-6) for c in lamps.colour]
        for mover in self.world.movers:
            if mover.box.kind not in _LAMP_KINDS or not (mover.moving or mover.instance % 5 == 0):
                continue  # most parked cars are dark
            pose, (length, width, _) = mover.pose(self.moment.time_s), mover.box.size_m
            to_eye = self.centre[:2] - pose[:2, 3]
            along = float(to_eye @ pose[:2, 0]) / max(float(np.linalg.norm(to_eye)), 1e-6)
            front = along > 0
            tint = np.array([1.0, 0.95, 0.85]) * along**2 if front else np.array([0.55, 0.03, 0.02])
            for side in (0.0,) if mover.box.kind == "motorcycle" else (-0.38, 0.38):
                out = (0.5 * length + 0.06) * (1 if front else -1)
                local = np.array([out, side * width, 0.65 if front else 0.85])
                at.append(pose[:3, :3] @ local + pose[:3, 3])
                colour.append(tint)
        return np.array(at).reshape(-1, 3), np.array(colour).reshape(-1, 3)

    @cached_property
    def bonnet(self) -> glass.Bonnet | None:
        """The own bonnet in this picture."""
        look = self.world.layout.lens.bonnet
        return None if look is None else glass.Bonnet.of(look, (self.camera.height_px, self.camera.width_px))

    def completed(self, view: WorldView) -> WorldView:
        """With the own bonnet in front of the street: it has no depth and does not move in the picture."""
        if self.bonnet is None:
            return view
        own = self.bonnet.cover > 0.5
        return replace(
            view,
            depth_m=np.where(own, 0, view.depth_m),
            instance=np.where(own, 0, view.instance),
            semantic=np.where(own, Semantic.OWN_CAR, view.semantic).astype(np.uint8),
            moving=view.moving & ~own,
            flow_px=np.where(own[..., None], 0, view.flow_px),
        )
