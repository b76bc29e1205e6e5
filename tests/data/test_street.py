"""The procedural street: equal for equal seeds, exact where it says so."""

import numpy as np
import pytest

from dreamdrive.data.street import Street, StreetBox, make_street
from dreamdrive.scene.camera import Camera


@pytest.fixture(scope="module")
def street() -> Street:
    return make_street(seed=3, frames=9, size=(160, 96), movers=3)


def lift(street: Street, frame: int) -> np.ndarray:
    """World points (H, W, 3) of a frame."""
    camera = street.cameras[frame]
    points = camera.rays() * street.depth_m[frame][..., None]
    return points @ camera.world_from_camera[:3, :3].T + camera.world_from_camera[:3, 3]


def project(camera: Camera, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixel coordinates (N, 2) and depth (N,)."""
    local = (points - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, :3]
    pixels = local @ camera.matrix.T
    return pixels[:, :2] / pixels[:, 2:], local[:, 2]


def test_equal_seeds_give_equal_streets_and_others_differ() -> None:
    first, second, other = (make_street(seed, 2, size=(64, 48)) for seed in (5, 5, 6))
    assert (first.frames == second.frames).all()
    assert (first.depth_m == second.depth_m).all()
    assert (first.frames != other.frames).mean() > 0.5


def test_shapes_and_world(street: Street) -> None:
    assert street.frames.shape == (9, 96, 160, 3)
    assert street.depth_m.shape == street.instance.shape == street.sky.shape == (9, 96, 160)
    np.testing.assert_array_equal(street.cameras[0].world_from_camera, np.eye(4))
    assert street.trajectory.length_m == pytest.approx(0.8 * 8, rel=0.1)
    assert 0.05 < street.sky.mean() < 0.4
    assert (street.sky == (street.depth_m == 0)).all()


def test_depth_of_static_pixels_agrees_between_frames(street: Street) -> None:
    static = ~street.sky[2] & ~street.moving[2]
    points = lift(street, 2)[static]
    pixels, depth = project(street.cameras[5], points)
    column, row = np.floor(pixels).astype(int).T
    inside = (depth > 0.5) & (column >= 1) & (row >= 1) & (column < 159) & (row < 95)
    column, row, depth = column[inside], row[inside], depth[inside]
    # Compared with a neighbourhood: the point falls between pixel centres of a slanted surface.
    patches = np.stack([street.depth_m[5][row + dy, column + dx] for dy in (-1, 0, 1) for dx in (-1, 0, 1)])
    seen = (depth > patches.min(0) - 0.02) & (depth < patches.max(0) + 0.02)
    hidden = depth > patches.max(0) + 0.02
    assert seen.mean() > 0.9
    assert (seen | hidden).mean() > 0.99


def test_colours_agree_between_frames(street: Street) -> None:
    static = ~street.sky[2] & ~street.moving[2]
    points = lift(street, 2)[static]
    pixels, depth = project(street.cameras[3], points)
    column, row = np.floor(pixels).astype(int).T
    inside = (depth > 0.5) & (column >= 0) & (row >= 0) & (column < 160) & (row < 96)
    seen = np.abs(street.depth_m[3][row[inside], column[inside]] / depth[inside] - 1) < 0.02
    here = street.frames[2][static][inside][seen].astype(float)
    there = street.frames[3][row[inside], column[inside]][seen].astype(float)
    # Limited by the half pixel of the nearest neighbour, not by the street.
    assert np.median(np.abs(here - there)) < 8
    assert np.median(np.abs(here - there[::-1])) > 20


def test_ground_pixels_lie_on_the_ground(street: Street) -> None:
    for frame in (0, 8):
        height = street.ground.height_m(lift(street, frame)[90, 60:100])
        road = street.instance[frame][90, 60:100] == 0
        np.testing.assert_allclose(height[road], 0, atol=1e-4)
    assert street.ground.offset_m == pytest.approx(1.5, abs=0.02)


def box_interior(box: StreetBox, frame: int, points: np.ndarray) -> np.ndarray:
    pose = box.world_from_box[frame]
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    return (np.abs(local) <= box.size_m / 2 + 1e-3).all(-1)


def test_labelled_pixels_lie_in_their_boxes(street: Street) -> None:
    for frame in (0, 4, 8):
        points = lift(street, frame)
        for box in street.boxes:
            mine = street.instance[frame] == box.instance
            assert box_interior(box, frame, points[mine]).all()
    assert {b.instance for b in street.boxes if b.moving} == {7, 8, 9}
    assert street.moving.any(axis=(1, 2)).all()


def test_moving_boxes_move_and_parked_ones_do_not(street: Street) -> None:
    for box in street.boxes:
        path = np.linalg.norm(np.diff(box.world_from_box[:, :3, 3], axis=0), axis=1)
        assert (path > 0.3).all() if box.moving else (path < 1e-9).all()


def test_views_from_elsewhere_are_exact_too(street: Street) -> None:
    t_s = float(street.times_s[4])
    again = street.world.view(street.cameras[4], t_s)
    assert (again.frame == street.frames[4]).all()
    pose = street.cameras[4].world_from_camera.copy()
    pose[:3, 3] += pose[:3, 0]
    beside = street.world.view(street.cameras[4].at(pose), t_s)
    assert (beside.frame != again.frame).mean() > 0.5


@pytest.mark.parametrize("seed", range(4))
def test_every_street_is_bright_textured_and_has_all_it_should(seed: int) -> None:
    street = make_street(seed, 2, size=(160, 96))
    grey = street.frames[0].astype(float).mean(-1)
    assert 60 < grey.mean() < 180
    assert np.abs(np.diff(grey, axis=1))[~street.sky[0][:, 1:]].mean() > 3
    assert len(np.unique(street.instance)) >= 5


def test_a_standing_camera_and_an_empty_street() -> None:
    street = make_street(0, 2, size=(64, 48), movers=0, parked=0, speed_m_s=0.0)
    assert street.boxes == ()
    assert not street.moving.any()
    assert street.trajectory.length_m < 0.1


def test_nonsense_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot make 0 frames"):
        make_street(frames=0)


def test_the_ground_plane_gives_the_depth_of_the_road(street: Street) -> None:
    depth = street.ground.depth_m(street.cameras[0])
    road = (street.instance[0] == 0)[80:, 50:110]
    np.testing.assert_allclose(depth[80:, 50:110][road], street.depth_m[0][80:, 50:110][road], rtol=1e-4)
