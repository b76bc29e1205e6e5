"""Control: shifts found in scenes of a few Gaussians, what is compared, and where an edge lies."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from dreamdrive.evaluate.truth.drawn import Truth
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import Similarity
from dreamdrive.splat import render
from dreamdrive_bench.control import compare as comparing
from dreamdrive_bench.control.compare import compare, edge_of
from dreamdrive_bench.control.made import Made
from dreamdrive_bench.control.shift import lowest, shift

SIZE, FRAMES = (96, 64), 3
CAMERAS = tuple(
    Camera(
        80,
        80,
        48,
        32,
        *SIZE,
        world_from_camera=np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.3 * k], [0, 0, 0, 1.0]]),
    )
    for k in range(FRAMES)
)
SAME = Similarity(1.0, np.eye(3), np.zeros(3))


def dots(centres: np.ndarray, colours: np.ndarray, size_m: float) -> Gaussians:
    count = len(centres)
    return Gaussians(
        means=torch.tensor(centres, dtype=torch.float32),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=torch.full((count, 3), float(np.log(size_m))),
        logit_opacities=torch.full((count,), 4.0),
        sh=torch.tensor((colours - 0.5) / 0.28209479, dtype=torch.float32)[:, None],
        source_frame=torch.zeros(count, dtype=torch.int64),
    )


def wall() -> Gaussians:
    """Grey in many shades, 14 m ahead."""
    x, y = np.meshgrid(np.arange(-11, 11.1, 0.4), np.arange(-7, 7.1, 0.4))
    centres = np.stack([x.ravel(), y.ravel(), np.full(x.size, 14.0)], axis=1)
    shade = np.random.default_rng(0).uniform(0.3, 0.7, (len(centres), 1))
    return dots(centres, np.repeat(shade, 3, axis=1), 0.3)


def car(x_m: float, y_m: float = 0.0) -> Gaussians:
    """2 m wide, 1.2 m high, 8 m ahead: red at one end, blue at the other."""
    x, y = np.meshgrid(np.arange(-1, 1.01, 0.2), np.arange(-0.6, 0.61, 0.2))
    colours = np.where(x.ravel()[:, None] < 0, [0.9, 0.1, 0.1], [0.1, 0.1, 0.9])
    return dots(np.stack([x.ravel() + x_m, y.ravel() + y_m, np.full(x.size, 8.0)], axis=1), colours, 0.15)


def scene_of(parked: list[Gaussians], driving: list[Gaussians]) -> Scene:
    empty = wall().select(torch.zeros(0, dtype=torch.int64))
    return Scene(
        static=Gaussians.concatenate(wall(), *parked) if parked else wall(),
        dynamic=driving[0] if driving else empty,
        deformation=None,
        actors=(),
        sky=None,
        exposure=None,
        cameras=CAMERAS,
        times_s=np.arange(FRAMES) / 10,
        held_out=np.zeros(FRAMES, bool),
    )


def made(scene: Scene, x_m: float | None = 0.0) -> object:
    """A scene whose truth has the car at a place, whatever the scene shows."""
    shape = FRAMES, SIZE[1], SIZE[0]
    instance = np.zeros(shape, np.int64)
    if x_m is not None:
        for k, camera in enumerate(CAMERAS):
            instance[k] = render(car(x_m), camera).alpha.numpy() > 0.5
    truth = Truth(CAMERAS, np.full(shape, 8.0), instance, instance > 0)
    frames = np.zeros((*shape, 3), np.uint8)
    return Made(SimpleNamespace(frames=frames), truth, scene, CAMERAS)


def shift_of(before: Scene, after: Scene, moving: bool, x_m: float = -1.0) -> float | None:
    """The truth says that the car is 2 m to the right now; the scene need not."""
    pair = made(before, x_m), made(after, x_m + 2)
    return shift(*pair, 1, np.array([2.0, 0, 0]), moving, lambda _: SAME)[0]


@pytest.mark.parametrize("moving", [True, False])
@pytest.mark.parametrize("went_m", [0.0, 0.6, 2.0, 3.1])
def test_a_car_is_found_where_the_scene_shows_it(moving: bool, went_m: float) -> None:
    before, after = (
        scene_of([], [car(x)]) if moving else scene_of([car(x)], []) for x in (-1.0, -1.0 + went_m)
    )
    assert shift_of(before, after, moving) == pytest.approx(went_m, abs=0.1)


@pytest.mark.parametrize("moving", [True, False])
def test_a_car_that_is_gone_is_not_found(moving: bool) -> None:
    before = scene_of([], [car(-1)]) if moving else scene_of([car(-1)], [])
    assert shift_of(before, scene_of([], []), moving) is None
    assert shift_of(scene_of([], []), before, moving) is None or not moving


def test_a_car_that_went_the_other_way_is_not_where_it_was_wanted() -> None:
    before, after = scene_of([], [car(-1)]), scene_of([], [car(-2)])
    assert shift_of(before, after, True) == pytest.approx(-1, abs=0.1)


def test_both_scenes_are_brought_onto_the_truth() -> None:
    """The second scene in a world of half the size, turned by a quarter: the same car, 2 m further."""
    similarity = Similarity(2.0, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([1.0, 2, 3]))
    before, after = scene_of([], [car(-1)]), scene_of([], [car(1)])

    def smaller(points: torch.Tensor) -> torch.Tensor:
        away = points.double().numpy() - similarity.translation
        return torch.tensor(away @ similarity.rotation / similarity.scale, dtype=torch.float32)

    def part(gaussians: Gaussians) -> Gaussians:
        return replace(
            gaussians, means=smaller(gaussians.means), log_scales=gaussians.log_scales - float(np.log(2))
        )

    cameras = []
    for camera in CAMERAS:
        pose = np.eye(4)
        pose[:3, :3] = similarity.rotation.T @ camera.world_from_camera[:3, :3]
        pose[:3, 3] = smaller(torch.tensor(camera.world_from_camera[:3, 3])).numpy()
        cameras.append(camera.at(pose))
    after = replace(after, static=part(after.static), dynamic=part(after.dynamic), cameras=tuple(cameras))
    second = replace(made(after, 1.0), views=tuple(cameras))
    brought: Callable[[object], Similarity] = lambda one: similarity if one is second else SAME  # noqa: E731
    found, frames = shift(made(before, -1.0), second, 1, np.array([2.0, 0, 0]), True, brought)
    assert found == pytest.approx(2.0, abs=0.1)
    assert frames == FRAMES


def test_what_changed_is_not_compared_and_all_else_is() -> None:
    before, after = (made(scene_of([], [car(x)]), x) for x in (-2.0, 2.0))
    figures = compare(before, after, 1)
    assert figures[0] == figures[2] == 99
    assert 0.3 < figures[1] < 0.9
    assert compare(before, after, None)[0] < 30  # nothing says that the car may differ
    assert compare(before, before, None) == (99, 1, 99)
    brighter = made(scene_of([car(0, -2.4)], [car(2)]), 2.0)
    assert compare(before, brighter, 1)[0] < 40


def test_the_edge_is_where_the_drawing_is_most_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    def drawn(metres: float, *_: object) -> SimpleNamespace:
        """The road's edge falls on a row by how wide it is, 8 px a metre."""
        rows = np.clip(np.arange(32) - 12 - 8 * metres, 0, 1)
        frames = np.broadcast_to((60 + 120 * rows)[None, :, None, None], (4, 32, 20, 3))
        return SimpleNamespace(frames=frames.astype(np.uint8))

    monkeypatch.setattr(comparing, "drive", drawn)
    monkeypatch.setattr(comparing, "widen_road", lambda layout, metres: metres)
    shown = SimpleNamespace(views=[None] * 4, truth=SimpleNamespace(size=(20, 32)))
    for metres in (0.0, 0.5, 0.3):
        monkeypatch.setattr(comparing, "render", lambda made, frame, m=metres: drawn(m).frames[frame] / 255)
        assert edge_of(shown, None) == pytest.approx(metres, abs=0.06)


def test_the_lowest_place_is_that_of_a_parabola_and_none_at_an_end() -> None:
    places = np.arange(-1.0, 2.01, 0.25)
    assert lowest(places, (places - 0.4) ** 2) == pytest.approx(0.4)
    assert lowest(places, places) is None
    assert lowest(places, -places) is None
