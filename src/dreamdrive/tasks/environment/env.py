"""DreamDrive-v0: drive in generated scenes in a closed loop."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import gymnasium
import numpy as np
import torch
from jaxtyping import Float, UInt8

from dreamdrive.errors import InputError
from dreamdrive.tasks.environment.above import draw_above
from dreamdrive.tasks.environment.bicycle import EgoState, driven
from dreamdrive.tasks.environment.courses import Cameras, Courses, Source
from dreamdrive.tasks.environment.observation import HIGH, LOW, LastAction, vector_of
from dreamdrive.tasks.environment.options import EnvironmentOptions
from dreamdrive.tasks.environment.pictures import Shifted
from dreamdrive.tasks.environment.reward import Reward, reward_of
from dreamdrive.tasks.environment.rig import SIZE_PX, Mount, check_size
from dreamdrive.tasks.environment.road import DrivableArea
from dreamdrive.tasks.environment.traffic import Traffic

Observation = dict[str, np.ndarray]
_TRIES = 20
"""Draws of a start at which the car lies on nothing."""
_RESET = ("scene", "start_s", "aside_m", "turned_rad", "speed_m_s")
_AWAY, _FARTHEST = ("aside_m", "turned_rad"), 1e4
"""Options of ``reset`` that lead away from the recorded path, and how far they may."""
_EDGE_S = 1e-6
_DEFAULT = EnvironmentOptions()
_LOADED_BY = os.getpid()


class DreamDriveEnv(gymnasium.Env[Any, np.ndarray]):
    """Drive in scenes that ``generate`` made.

    An observation has ``vector``, float32 (K,), see ``observation.NAMES``, and, where there are cameras,
    ``camera``, uint8 (N, H, W, 3). An action is acceleration and steering, each from -1 (brake, right) to 1.

    Args:
        scenes: One or more: folders, or scenes that are loaded. Each episode is in one that the seed draws.
        cameras: ``"front"`` is the camera that recorded, ``"rig"`` all that did; or a list of mounts. With
            none of them nothing is drawn.
        size_px: Width and height of pictures of the scene's own cameras.
        roads: The drivable area of each scene, or None where nothing tells.
        traffic: ``"recorded"``, or ``"react"``: road users follow their paths, but brake for what is ahead.
        render_mode: ``"rgb_array"`` shows the first camera, ``"above"`` the surroundings from above.
        options: All else.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "above"], "render_fps": 10}  # noqa: RUF012

    def __init__(
        self,
        scenes: Source | Sequence[Source],
        *,
        cameras: Cameras = "front",
        size_px: tuple[int, int] = SIZE_PX,
        roads: DrivableArea | Sequence[DrivableArea | None] | None = None,
        traffic: str = "recorded",
        render_mode: str | None = None,
        options: EnvironmentOptions = _DEFAULT,
    ) -> None:
        if os.getpid() != _LOADED_BY:
            # Forked, as by AsyncVectorEnv: torch would wait for ever for threads that stayed with the parent.
            torch.set_num_threads(1)
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode {render_mode!r}; expected rgb_array, above or None")
        if traffic not in ("recorded", "react"):
            raise InputError(f"traffic {traffic!r}; expected recorded or react")
        _check_cameras(cameras)
        check_size(size_px)
        sources = scenes if isinstance(scenes, Sequence) and not isinstance(scenes, str) else [scenes]
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": round(1 / options.step_s)}
        self._options, self._reacts = options, traffic == "react"
        self._courses = Courses(
            sources, [roads] if isinstance(roads, DrivableArea) else roads, cameras, size_px, options
        )
        self._index, self._begun = 0, False
        self._shape = self._shape_of(cameras, size_px) if cameras else None
        spaces: dict[str, gymnasium.Space[Any]] = {"vector": gymnasium.spaces.Box(LOW, HIGH)}
        if self._shape is not None:
            spaces["camera"] = gymnasium.spaces.Box(0, 255, self._shape, np.uint8)
        self.observation_space = gymnasium.spaces.Dict(spaces)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Decides all draws from here on.
            options: What is not to be drawn: ``scene``, its number; ``start_s``, on the clock of the scene;
                ``aside_m``, to the left of the recorded path; ``turned_rad``, to the left of where it
                points; ``speed_m_s``.

        Raises:
            InputError: The options name something else, or a scene cannot be driven in.
        """
        super().reset(seed=seed)
        given = _checked(options or {}, len(self._courses))
        drawn = int(self.np_random.integers(len(self._courses)))
        self._index = int(given.get("scene", drawn))
        self._course = self._courses.course(self._index)
        self._traffic = Traffic(self._course.road_users, self._options.traffic if self._reacts else None)
        self._begin(given)
        self._action, self._steps = LastAction(), 0
        self._seen, self._begun = self._look(), True
        return self._observation(), self._info(None, "", False)

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for one step.

        Args:
            action: Acceleration and steering (2,); beyond [-1, 1] they count as the nearer end.
        """
        self._check_begun()
        chosen = _numbers(action)
        if chosen is None or chosen.shape != (2,) or not np.isfinite(chosen).all():
            raise InputError(f"action {action!r}; expected two finite numbers, acceleration and steering")
        o, before = self._options, self._on_path
        self._action = LastAction(*np.clip(chosen, -1.0, 1.0).tolist())
        self._steps += 1
        self._time_s = self._time_of(self._steps)
        self._traffic.step(self._time_s, self._state.rectangle(o.ego), self._state.speed_m_s)
        self._state = driven(self._state, self._action.acceleration, self._action.steering, o.step_s, o.ego)
        self._on_path = self._course.path.beside(self._state.x_m, self._state.y_m, before.along_m)
        hit = self._course.hit(self._state.rectangle(o.ego), self._traffic.states)
        off_road = self._off_road()
        reward = reward_of(before, self._on_path, self._state, bool(hit), off_road, o.step_s, o.ego, o.reward)
        self._seen = self._look()
        terminated = bool(hit) or off_road
        return self._observation(), reward.total, terminated, self._over(), self._info(reward, hit, off_road)

    def render(self) -> UInt8[np.ndarray, "h w 3"] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The picture that the render mode asks for."""
        if self.render_mode is None:
            return None
        self._check_begun()
        if self.render_mode == "above":
            return draw_above(self._course, self._state, self._traffic.states, self._options.ego)
        return (self._drawn() if self._seen is None else self._seen)[0].copy()

    def close(self) -> None:
        """Let go of all scenes."""
        self._courses.clear()

    def _check_begun(self) -> None:
        if not self._begun:
            raise gymnasium.error.ResetNeeded("no episode has begun; call reset first")

    def _shape_of(self, cameras: Cameras, size_px: tuple[int, int]) -> tuple[int, int, int, int]:
        if cameras == "front":
            return 1, size_px[1], size_px[0], 3
        mounts = self._courses.pictures(0).mounts if isinstance(cameras, str) else cameras
        sizes = {(each.pinhole.height_px, each.pinhole.width_px) for each in mounts}
        if len(sizes) > 1:
            raise InputError(
                f"cameras: heights and widths {sorted(sizes)}; expected one size of all pictures"
            )
        return len(mounts), *sizes.pop(), 3

    def _begin(self, given: Mapping[str, float]) -> None:
        """Draw a start at which the car lies on nothing and is on the road; else take the recorded one."""
        for _ in range(_TRIES):
            self._place(given, self.np_random.uniform(size=4).tolist())
            if not self._off_road() and not self._course.hit(
                self._state.rectangle(self._options.ego), self._traffic.states
            ):
                return
        self._place({"aside_m": 0.0, "turned_rad": 0.0, **given}, [0.5, 0.5, 0.5, 0.5])

    def _place(self, given: Mapping[str, float], drawn: list[float]) -> None:
        """Put the car where the options and numbers from 0 to 1 say."""
        o, path, step_s = self._options.start, self._course.path, self._options.step_s
        first_s, last_s = float(path.times_s[0]), self._end_s
        share = o.share[0] + drawn[0] * (o.share[1] - o.share[0])
        start_s = min(share * (float(path.times_s[-1]) - first_s), last_s - first_s - 2 * step_s)
        # Times come again in the next episode, which saves work.
        start_s = first_s + step_s * math.floor(max(start_s, 0.0) / step_s + _EDGE_S)
        start_s = given.get("start_s", start_s)
        if not first_s <= start_s <= last_s - 2 * step_s + _EDGE_S:
            raise InputError(
                f"start_s {start_s:g}: {self._course.name} can be entered from {first_s:g} to "
                f"{last_s - 2 * step_s:g} s"
            )
        aside_m = given.get("aside_m", (2 * drawn[1] - 1) * o.aside_m)
        turned_rad = given.get("turned_rad", (2 * drawn[2] - 1) * o.turned_rad)
        recorded = self._course.recorded(start_s)
        speed_m_s = (o.speed[0] + drawn[3] * (o.speed[1] - o.speed[0])) * recorded.speed_m_s
        speed_m_s = min(given.get("speed_m_s", speed_m_s), self._options.ego.top_speed_m_s)
        x_m = recorded.x_m - aside_m * math.sin(recorded.yaw_rad)
        y_m = recorded.y_m + aside_m * math.cos(recorded.yaw_rad)
        self._start_s = self._time_s = start_s
        self._state = EgoState(x_m, y_m, recorded.yaw_rad + turned_rad, speed_m_s)
        self._on_path = path.beside(x_m, y_m, path.along_at(start_s))
        self._traffic.start(start_s)

    @property
    def _end_s(self) -> float:
        return float(self._course.path.times_s[-1]) + self._options.beyond_s

    def _time_of(self, step: int) -> float:
        """Rounded, so that the same times are the same numbers."""
        return round(self._start_s + step * self._options.step_s, 6)

    def _off_road(self) -> bool:
        road, o = self._course.road, self._options
        if road is None:
            return abs(self._on_path.aside_m) > o.off_path_m
        return road.sticks_out_m(self._state.rectangle(o.ego)) > o.road_margin_m

    def _over(self) -> bool:
        o = self._options
        late = self._time_s >= self._end_s - _EDGE_S
        far = self._on_path.along_m > self._course.path.length_m + o.beyond_m
        return late or far or (o.max_steps is not None and self._steps >= o.max_steps)

    def _look(self) -> UInt8[np.ndarray, "n h w 3"] | None:
        return None if self._shape is None else self._drawn()

    def _drawn(self) -> UInt8[np.ndarray, "n h w 3"]:
        pictures = self._courses.pictures(self._index)
        pose = self._course.world_from_ego(self._state, self._on_path.along_m)
        seen = pictures.draw(self._time_s, pose, self._shifted())
        if self._shape is not None and seen.shape != self._shape:
            raise InputError(
                f"{self._course.name} has {len(seen)} cameras, the first scene {self._shape[0]}; give scenes "
                "of equal rigs, or a list of mounts"
            )
        return seen

    def _shifted(self) -> list[Shifted]:
        """Actors that are not where they were recorded at this time."""
        road_users, clocks_s = self._course.road_users, self._traffic.clocks_s
        last_s = float(self._course.path.times_s[-1])
        goes_on = np.isinf(road_users.seen_s[:, 1]) & (self._time_s > last_s + _EDGE_S)
        there = self._traffic.states.there
        rows = np.flatnonzero((clocks_s < self._time_s - _EDGE_S) | goes_on)
        return [Shifted(road_users.ids[row], float(clocks_s[row]), bool(there[row])) for row in rows.tolist()]

    def _observation(self) -> Observation:
        states, o = self._traffic.states, self._options
        vector: Float[np.ndarray, " k"] = vector_of(
            self._state, self._on_path, self._action, self._course.path, states, o.ego
        )
        return {"vector": vector} if self._seen is None else {"vector": vector, "camera": self._seen}

    def _info(self, reward: Reward | None, hit: str, off_road: bool) -> dict[str, Any]:
        """What a log of an episode wants to know."""
        terms = {} if reward is None else {"reward": asdict(reward)}
        trust = {"expected_psnr_db": self._expected_db()} if self._options.trust else {}
        return {
            "scene": self._course.name,
            "time_s": self._time_s,
            "x_m": self._state.x_m,
            "y_m": self._state.y_m,
            "yaw_rad": self._state.yaw_rad,
            "along_m": self._on_path.along_m,
            "aside_m": self._on_path.aside_m,
            "hit": hit,
            "off_road": off_road,
            **trust,
            **terms,
        }

    def _expected_db(self) -> float:
        """Of a picture of the first camera; of actors as they were recorded."""
        mount = self._courses.pictures(self._index).mounts[0]
        world_from_ego = self._course.world_from_ego(self._state, self._on_path.along_m)
        camera = mount.pinhole.at(world_from_ego @ mount.ego_from_camera)
        return self._courses.trust(self._index).view(camera, self._time_s).psnr_db


def _check_cameras(cameras: object) -> None:
    """Raise ``InputError`` unless these are cameras that an environment can have."""
    mounts = cameras if isinstance(cameras, tuple | list) else None
    if cameras not in ("front", "rig") and (mounts is None or not all(isinstance(e, Mount) for e in mounts)):
        raise InputError(f"cameras {cameras!r}; expected front, rig or a list of mounts")
    for each in mounts or ():
        check_size((each.pinhole.width_px, each.pinhole.height_px))


def _numbers(value: object) -> Float[np.ndarray, "..."] | None:
    """As an array; None of what is no number."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None


def _checked(options: Mapping[str, Any], scenes: int) -> Mapping[str, float]:
    """Options of ``reset``; ``InputError`` where they name what there is not."""
    unknown = [name for name in options if name not in _RESET]
    if unknown:
        raise InputError(f"reset: unknown option {unknown[0]!r}; expected {', '.join(_RESET)}")
    found = {name: _numbers(value) for name, value in options.items()}
    numbers = {name: float(each) for name, each in found.items() if each is not None and not each.ndim}
    if len(numbers) < len(found) or not all(map(math.isfinite, numbers.values())):
        raise InputError(f"reset: {dict(options)}; expected a finite number of each")
    if numbers.get("speed_m_s", 0.0) < 0 or max(abs(numbers.get(name, 0.0)) for name in _AWAY) > _FARTHEST:
        raise InputError(
            f"reset: {dict(options)}; expected no speed below 0, {' and '.join(_AWAY)} within {_FARTHEST:g}"
        )
    if numbers.get("scene", 0) not in range(scenes):
        raise InputError(f"reset: scene {options['scene']}; expected 0 to {scenes - 1}")
    return numbers
