"""A rigid cloud of points that drives and turns, seen by a camera that drives too."""

from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np
import pytest

from dreamdrive.decompose.actors.observations import Carried, Observations, PlacingOptions
from dreamdrive.decompose.actors.placing import placed
from dreamdrive.decompose.actors.points import CarriedPoints
from dreamdrive.scene.camera import Camera

UP = np.array([0.0, -1.0, 0.0])
FRAMES = 9


@dataclass(frozen=True)
class Street:
    """Cameras, times, places, yaws and surfaces of a thing in the world."""

    cameras: list[Camera]
    times_s: np.ndarray
    place_m: np.ndarray
    yaw_rad: np.ndarray
    surface_m: list[np.ndarray]

    def carried(
        self, factor: np.ndarray, lost: float = 0.0, shape: np.ndarray | None = None, seed: int = 0
    ) -> list[Carried]:
        """What flow finds, with wrong factors of frames and of points; of a share it is lost."""
        rng = np.random.default_rng(seed)
        found: list[Carried] = []
        count = len(self.cameras)
        pairs = [(k, k + way) for k in range(count) for way in (-1, 1)]
        for k, to in [pair for pair in pairs if 0 <= pair[1] < count]:
            one, two = (self.cameras[at].project(self.surface_m[at]) for at in (k, to))
            target = two[:, :2] + rng.normal(0, 0.3, (len(two), 2))
            wrong = rng.random(len(two)) < lost
            target[wrong] = one[wrong, :2]
            first_m, second_m = one[:, 2] * factor[k], two[:, 2] * factor[to]
            if shape is not None:
                first_m, second_m = first_m * shape[k], second_m * shape[to]
            found.append(Carried(k, to, np.arange(len(one)), one[:, :2], first_m, target, second_m))
        return found

    def observations(self, middles_m: np.ndarray, cut: int = 0) -> Observations:
        """Its first frames, as many as there are middles; the border cuts the thing off in some of them."""
        count = len(middles_m)
        return Observations(self.cameras[:count], self.times_s[:count], middles_m, np.arange(count) >= cut)

    def middles_m(self, factor: np.ndarray) -> np.ndarray:
        """The middles of what the frames see."""
        seen = [
            camera.lift(camera.project(points) * [1, 1, each])
            for camera, points, each in zip(self.cameras, self.surface_m, factor, strict=True)
        ]
        return np.stack([np.median(points, axis=0) for points in seen])


def turn(yaw_rad: float) -> np.ndarray:
    """About the axis that points up, which is -y."""
    c, s = cos(yaw_rad), sin(yaw_rad)
    return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])


def street(speed_m_s: float, yaw_rate: float = 0.0, interval_s: float = 0.1) -> Street:
    times = interval_s * np.arange(FRAMES)
    rng = np.random.default_rng(1)
    body = rng.uniform([-0.9, -1.2, -2], [0.9, 0.2, 2], (150, 3))
    yaw = yaw_rate * times
    # It goes where it points.
    halfway = [turn(a - 0.5 * yaw_rate * interval_s) @ [0, 0, speed_m_s * interval_s] for a in yaw]
    place = np.cumsum([[2.5, 0.8, 24 if speed_m_s < 0 else 14], *halfway[1:]], axis=0)
    cameras: list[Camera] = []
    for t in times:
        pose = np.eye(4)
        pose[2, 3] = 5 * t
        cameras.append(Camera(250, 250, 160, 96, 320, 192, pose))
    surfaces = [body @ turn(a).T + p for a, p in zip(yaw, place, strict=True)]
    return Street(cameras, times, place, yaw, surfaces)


def moved(place_m: np.ndarray, at: int = FRAMES // 2) -> np.ndarray:
    return place_m - place_m[at]


@pytest.mark.parametrize("speed_m_s", [-12.0, 0.5, 6.0])
@pytest.mark.parametrize("yaw_rate", [0.0, 0.2])
def test_place_and_yaw_are_found_though_depth_is_off(speed_m_s: float, yaw_rate: float) -> None:
    true = street(speed_m_s, yaw_rate)
    factor = np.exp(np.random.default_rng(2).normal(0, 0.06, FRAMES))
    found = placed(true.observations(true.middles_m(factor)), true.carried(factor), UP, PlacingOptions())
    scale = 1 / np.mean(found.factor * factor)  # no frame tells the common factor
    assert scale == pytest.approx(1, abs=0.06)
    assert np.abs(found.factor * factor * scale - 1).max() < 0.05
    assert np.abs(moved(found.place_m) - moved(true.place_m)).max() < 0.5
    assert np.abs(moved(found.yaw_rad) - moved(true.yaw_rad)).max() < radians(3)


def test_flow_that_is_lost_does_not_count() -> None:
    true, right = street(-12.0), np.ones(FRAMES)
    flow = true.carried(right, lost=0.4)
    found = placed(true.observations(true.middles_m(right)), flow, UP, PlacingOptions())
    assert np.abs(moved(found.place_m) - moved(true.place_m)).max() < 0.25


def test_without_flow_motion_is_smooth() -> None:
    true = street(6.0)
    middles = true.place_m + np.random.default_rng(3).normal(0, 0.3, (FRAMES, 3))
    middles[3] += [0, 0, 9.0]  # one frame has it all wrong
    found = placed(true.observations(middles), (), UP, PlacingOptions())
    rough = np.abs(np.diff(middles, n=2, axis=0)).max()
    assert np.abs(np.diff(found.place_m, n=2, axis=0)).max() < 0.02 * rough
    assert np.abs(found.place_m - true.place_m).max() < 0.6


def test_frames_that_the_border_cuts_off_do_not_draw_the_path_to_what_they_show() -> None:
    true, right = street(0.5), np.ones(FRAMES)
    middles = true.middles_m(right)
    middles[:4] += [0, 0, 2.0]  # they see one end alone
    flow = true.carried(right)
    off = [
        np.abs(
            moved(placed(true.observations(middles, cut), flow, UP, PlacingOptions()).place_m)
            - moved(true.place_m)
        )
        for cut in (0, 4)
    ]
    assert off[1].max() < 0.15
    assert off[1].max() < 0.5 * off[0].max()


def test_the_depth_of_single_points_is_found_too() -> None:
    true, right = street(14.0), np.ones(FRAMES)
    shape = np.exp(np.random.default_rng(4).normal(0, 0.06, (FRAMES, len(true.surface_m[0]))))
    flow = true.carried(right, shape=shape)
    found = placed(true.observations(true.middles_m(right)), flow, UP, PlacingOptions())
    left = np.concatenate([np.log(p.factor * shape[k][p.point]) for k, p in enumerate(found.points)])
    assert np.std(left) < 0.8 * np.std(np.log(shape))
    rigid = placed(true.observations(true.middles_m(right)), flow, UP, PlacingOptions(shape=1e-4))
    off, rigid_off = (np.abs(moved(each.place_m) - moved(true.place_m)).max() for each in (found, rigid))
    assert off < 0.6 * rigid_off


def test_points_are_eliminated_as_if_they_were_solved_for() -> None:
    true, factor = street(3.0), np.ones(3)
    shape = np.exp(np.random.default_rng(5).normal(0, 0.005, (FRAMES, len(true.surface_m[0]))))
    flow = [each for each in true.carried(np.ones(FRAMES), shape=shape) if max(each.first, each.second) < 3]
    points = CarriedPoints(true.cameras[:3], flow, UP, PlacingOptions())
    state = np.zeros((3, 5))
    state[:, :3] = true.place_m[:3] + np.array([0.005, 0, 0.01])
    before = points.terms(state, 1e9)
    step = np.linalg.solve(before[0] + 1e-3 * np.eye(15), -before[1]).reshape(3, 5)
    points.follow(step)
    after = points.terms(state + step, 1e9)[1]
    # Where points follow, the states' gradient vanishes in the same step.
    assert np.abs(after).max() < 0.15 * np.abs(before[1]).max()
    assert all(
        (each.factor != known).any() for each, known in zip(points.depths(factor), factor, strict=True)
    )


def test_a_thing_points_where_it_goes() -> None:
    times_s = 0.1 * np.arange(24)
    angle = 0.5 * times_s  # it drives a curve at 8 m/s
    middles = np.column_stack([16 * (1 - np.cos(angle)) + 2, 0.8 + 0 * angle, 12 + 16 * np.sin(angle)])
    camera = Camera(250, 250, 160, 96, 320, 192, np.eye(4))
    observations = Observations([camera] * 24, times_s, middles, np.ones(24, dtype=bool))
    free = PlacingOptions(place=0, acceleration_m_s2=5, yaw_rate_deg_s=60, yaw_acceleration_deg_s2=200)
    turned = placed(observations, (), UP, free).yaw_rad
    assert turned[-1] - turned[0] == pytest.approx(angle[0] - angle[-1], rel=0.4)


@pytest.mark.parametrize("speed_m_s", [14.0, -12.0])
def test_it_points_forwards_even_where_what_is_seen_goes_backwards(speed_m_s: float) -> None:
    true, right = street(speed_m_s), np.ones(FRAMES)
    middles = true.middles_m(right)
    middles[-1, 2] -= 30.0 * np.sign(speed_m_s)  # the last frame has it all wrong
    found = placed(true.observations(middles), true.carried(right), UP, PlacingOptions())
    assert found.ahead @ [0, 0, np.sign(speed_m_s)] > 0.98


@pytest.mark.parametrize("count", [1, 2])
def test_one_or_two_frames_are_enough(count: int) -> None:
    true = street(3.0)
    flow = [each for each in true.carried(np.ones(FRAMES)) if max(each.first, each.second) < count]
    found = placed(true.observations(true.middles_m(np.ones(FRAMES))[:count]), flow, UP, PlacingOptions())
    assert found.place_m.shape == (count, 3)
    assert np.allclose(np.diff(found.place_m, axis=0), np.diff(true.place_m[:count], axis=0), atol=0.1)
    assert found.yaw_rad[count // 2] == 0
