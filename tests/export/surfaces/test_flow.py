"""Flow as other programs read it, against what is known in closed form."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.export import export, scene_to_flow
from dreamdrive.export.surfaces.flow import flow_between
from dreamdrive.export.surfaces.surface import surface_of
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from tests.export.surfaces.boards import AHEAD_M, ASIDE_M, CAR_M, PINHOLE, TIMES_S, WALL_M, boards


@pytest.fixture(scope="module")
def scene() -> Scene:
    return boards()


@pytest.fixture(scope="module")
def written(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("flow") / "KittiFlow"
    export(scene, "flow", folder)
    return folder


def flow_read(file: Path) -> tuple[np.ndarray, np.ndarray]:
    """As the development kit of KITTI's flow benchmark has it; OpenCV turns the channels round."""
    picture = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert picture is not None
    assert picture.dtype == np.uint16
    values = picture[..., ::-1].astype(np.float64)
    return (values[..., :2] - 2**15) / 64, values[..., 2] > 0


def moved(depth_m: float, aside_m: float) -> np.ndarray:
    """Where points of the first camera's pixels at a depth are in the next frame."""
    rays = PINHOLE.rays()
    points = rays * depth_m + [aside_m, 0, -AHEAD_M]
    at_px = points[..., :2] / points[..., 2:] * 80 + [48, 32]
    return at_px - (rays[..., :2] * 80 + [48, 32])


def test_what_stands_flows_by_the_camera_and_what_moves_by_its_motion(scene: Scene, written: Path) -> None:
    folder = written / "training"
    flow_px, known = flow_read(folder / "flow_occ" / "000000_10.png")
    depth_m = surface_of(scene, scene.cameras[0], 0.0).depth_m
    wall, car = np.abs(depth_m - WALL_M) < 0.01, np.abs(depth_m - CAR_M) < 0.01
    sky = depth_m == 0
    assert min(wall.sum(), car.sum(), sky.sum()) > 100
    assert known.all()
    np.testing.assert_allclose(flow_px[wall], moved(WALL_M, 0.0)[wall], atol=0.03)
    np.testing.assert_allclose(flow_px[car], moved(CAR_M, ASIDE_M)[car], atol=0.05)
    # The camera goes straight on: what is infinitely far stays.
    assert not flow_px[sky].any()


def test_what_the_next_frame_hides_is_left_out_of_flow_noc(scene: Scene, written: Path) -> None:
    all_px, known = flow_read(written / "training" / "flow_occ" / "000000_10.png")
    shown_px, shown = flow_read(written / "training" / "flow_noc" / "000000_10.png")
    np.testing.assert_array_equal(shown_px[shown], all_px[shown])
    hidden = known & ~shown
    rows, columns = np.mgrid[:64, :96] + 0.5
    x, y = columns + moved(WALL_M, 0.0)[..., 0], rows + moved(WALL_M, 0.0)[..., 1]
    # The car's board in the next frame, at 4.5 m: from -0.25 to 0.75 m aside, 0.5 to 1.5 m down.
    left, right = (48 + (each + ASIDE_M) * 80 / (CAR_M - AHEAD_M) for each in (-0.5, 0.5))
    top, low = (32 + each * 80 / (CAR_M - AHEAD_M) for each in (0.5, 1.5))
    depth_m = surface_of(scene, scene.cameras[0], 0.0).depth_m
    wall = np.abs(depth_m - WALL_M) < 0.1
    within = wall & (x > left + 2) & (x < right - 2) & (y > top + 2) & (y < low - 2)
    outside = (x < 0) | (x >= 96) | (y < 0) | (y >= 64)
    assert min(within.sum(), outside.sum()) > 20
    assert hidden[within].all()
    assert hidden[outside & wall].all()
    beside = (x < left - 2) | (x > right + 2) | (y < top - 2) | (y > low + 2)
    assert not hidden[wall & beside & ~outside].any()


def test_the_next_frame_brought_back_is_the_frame(scene: Scene, written: Path) -> None:
    folder = written / "training"
    pairs = sorted(each.name[:6] for each in (folder / "flow_noc").iterdir())
    assert pairs == ["000000", "000001"]
    for pair in pairs:
        one, next_one = (cv2.imread(str(folder / "image_2" / f"{pair}_{k}.png")) for k in (10, 11))
        assert one is not None
        assert next_one is not None
        flow_px, shown = flow_read(folder / "flow_noc" / f"{pair}_10.png")
        rows, columns = np.mgrid[:64, :96].astype(np.float32)
        at = [(grid + flow_px[..., axis]).astype(np.float32) for axis, grid in ((0, columns), (1, rows))]
        back = cv2.remap(next_one, at[0], at[1], cv2.INTER_LINEAR)
        wrong = np.abs(back.astype(float) - one).mean(axis=-1)
        still = np.abs(next_one.astype(float) - one).mean(axis=-1)
        assert shown.mean() > 0.7
        assert wrong[shown].mean() < 0.25 * still[shown].mean()


def test_the_sky_turns_with_the_camera(scene: Scene) -> None:
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_rotvec([0, 0.05, 0]).as_matrix()
    now = surface_of(scene, PINHOLE, 0.0)
    flow_px, known, shown = flow_between(now, surface_of(scene, PINHOLE.at(turned), 0.0))
    far = PINHOLE.rays() @ turned[:3, :3]
    expected = far[..., :2] / far[..., 2:] * 80 - PINHOLE.rays()[..., :2] * 80
    assert (known & shown)[now.beyond].mean() > 0.8
    np.testing.assert_allclose(flow_px[now.beyond], expected[now.beyond], atol=1e-9)


def test_holes_below_the_horizon_are_not_known(scene: Scene) -> None:
    empty = replace(scene, static=scene.static.select(scene.static.means[:, 0] < 0))
    now = surface_of(empty, PINHOLE, 0.0)
    assert now.depth_m[60, 90] == 0
    _, known, _ = flow_between(now, now)
    assert known[2, 90]
    assert not known[60, 90]


def test_a_street_of_single_frames_goes_with_its_velocities(scene: Scene) -> None:
    count = len(scene.static)
    velocity, life = (
        torch.tensor([[0.0, 0, 2.0]]).repeat(count, 1),
        torch.tensor([[0.0, 50.0]]).repeat(count, 1),
    )
    street = replace(
        scene.without(0), static=replace(scene.static, velocity=velocity, lifespan=life), actors=()
    )
    assert street.moves_per_frame
    goes = surface_of(street, PINHOLE, 0.0, 0.1)
    np.testing.assert_allclose(goes.way_m[60], np.tile([0.0, 0.0, 0.2], (96, 1)), atol=1e-4)
    assert not surface_of(street, PINHOLE, 0.0).way_m.any()


def test_pictures_are_those_of_the_scene(scene: Scene, written: Path) -> None:
    last = cv2.imread(str(written / "training" / "image_2" / "000001_11.png"))
    assert last is not None
    np.testing.assert_array_equal(last[..., ::-1], render_scene(scene, scene.cameras[2], 0.2).picture)


def test_one_frame_has_no_flow(scene: Scene, tmp_path: Path) -> None:
    one = replace(scene, cameras=scene.cameras[:1], times_s=TIMES_S[:1], held_out=np.zeros(1, bool))
    with pytest.raises(InputError, match="the drive has one frame"):
        scene_to_flow(one, tmp_path / "set")
    assert list(tmp_path.iterdir()) == []
