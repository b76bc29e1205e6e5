"""The procedural street: equal for equal seeds, exact where it says so."""

import numpy as np
import pytest

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.layout import is_moving
from dreamdrive.scene.street.truth import DriveTruth, Semantic, WorldBox
from streetworld import StreetOptions, World, draw_street, drive, make_street


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return make_street(seed=3, frames=9, size=(160, 96))


def lift(street: DriveTruth, frame: int) -> np.ndarray:
    """World points (H, W, 3) of a frame."""
    camera = street.cameras[frame]
    points = camera.rays() * street.depth_m[frame][..., None]
    return points @ camera.world_from_camera[:3, :3].T + camera.world_from_camera[:3, 3]


def project(camera: Camera, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixel coordinates (N, 2) and depth (N,)."""
    local = (points - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, :3]
    pixels = local @ camera.matrix.T
    return pixels[:, :2] / pixels[:, 2:], local[:, 2]


def test_equal_seeds_give_equal_streets_and_others_differ(street: DriveTruth) -> None:
    again, other = (make_street(seed, frames=9, size=(160, 96)) for seed in (3, 4))
    assert (again.frames == street.frames).all()
    assert (again.depth_m == street.depth_m).all()
    assert (other.frames != street.frames).mean() > 0.5


def test_shapes_and_world(street: DriveTruth) -> None:
    assert street.frames.shape == (9, 96, 160, 3)
    assert street.depth_m.shape == street.instance.shape == street.sky.shape == (9, 96, 160)
    np.testing.assert_array_equal(street.cameras[0].world_from_camera, np.eye(4))
    assert 0.8 * 5 < street.trajectory.length_m < 0.8 * 11
    assert 0.02 < street.sky.mean() < 0.5
    assert (street.sky == (street.depth_m == 0)).all()


def test_depth_of_static_pixels_agrees_between_frames(street: DriveTruth) -> None:
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


def test_colours_agree_between_frames(street: DriveTruth) -> None:
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


def test_ground_pixels_lie_on_the_ground(street: DriveTruth) -> None:
    for frame in (0, 8):
        height = street.ground.height_m(lift(street, frame)[90])
        road = street.semantic[frame][90] == Semantic.ROAD
        assert road.any()
        np.testing.assert_allclose(height[road], 0, atol=1e-4)
    assert street.ground.offset_m == pytest.approx(1.5, abs=0.02)


def box_interior(box: WorldBox, frame: int, points: np.ndarray) -> np.ndarray:
    pose = box.world_from_box[frame]
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    return (np.abs(local) <= box.size_m / 2 + 0.02).all(-1)


def test_labelled_pixels_lie_in_their_boxes(street: DriveTruth) -> None:
    for frame in (0, 4, 8):
        points = lift(street, frame)
        for box in street.boxes:
            mine = street.instance[frame] == box.instance
            assert box_interior(box, frame, points[mine]).all(), box.id
    assert street.moving.any(axis=(1, 2)).all()


def test_moving_boxes_move_and_parked_ones_do_not(street: DriveTruth) -> None:
    for box in street.boxes:
        path = np.linalg.norm(np.diff(box.world_from_box[:, :3, 3], axis=0), axis=1)
        assert (path > 0.05).all() if box.moving else (path < 1e-9).all()
        of_box = street.instance == box.instance
        assert (street.moving[of_box] == box.moving).all()


def test_flow_leads_to_the_same_surface_in_the_next_frame(street: DriveTruth) -> None:
    rows, columns = np.mgrid[:96, :160]
    for chosen in (street.moving[3], ~street.moving[3] & ~street.sky[3]):
        to = np.stack([columns, rows], axis=-1) + 0.5 + street.flow_px[3]
        x, y = (np.floor(to[..., k]).astype(int) for k in (0, 1))
        inside = chosen & (x >= 0) & (y >= 0) & (x < 160) & (y < 96)
        same = street.instance[4][y[inside], x[inside]] == street.instance[3][inside]
        assert same.mean() > 0.85
        here, there = (
            street.frames[k][at][same].astype(float)
            for k, at in ((3, (rows[inside], columns[inside])), (4, (y[inside], x[inside])))
        )
        assert np.median(np.abs(here - there)) < 10
    assert np.abs(street.flow_px[3][street.moving[3]]).max() > 1


def test_flow_of_the_sky_is_that_of_turning_alone(street: DriveTruth) -> None:
    first, second = street.cameras[3], street.cameras[4]
    turned = second.world_from_camera[:3, :3].T @ first.world_from_camera[:3, :3]
    rays = first.rays()[street.sky[3]] @ turned.T @ second.matrix.T
    rows, columns = np.nonzero(street.sky[3])
    expected = rays[:, :2] / rays[:, 2:] - np.stack([columns, rows], axis=-1) - 0.5
    np.testing.assert_allclose(street.flow_px[3][street.sky[3]], expected, atol=1e-3)


def test_classes_agree_with_labels_and_heights(street: DriveTruth) -> None:
    for frame in (0, 8):
        classes = street.semantic[frame]
        assert ((classes == Semantic.SKY) == street.sky[frame]).all()
        users = np.isin(
            classes, [Semantic.CAR, Semantic.VAN, Semantic.TRUCK, Semantic.BICYCLE, Semantic.PEDESTRIAN]
        )
        assert (users == (street.instance[frame] > 0)).all()
        height = street.ground.height_m(lift(street, frame))
        flat = np.isin(classes, [Semantic.ROAD, Semantic.MARKING, Semantic.GRASS])
        np.testing.assert_allclose(height[flat], 0, atol=2e-3)
        assert (height[classes == Semantic.SIDEWALK] < 0.13).all()
        kinds = {box.instance: Semantic[box.kind.upper()] for box in street.boxes}
        for label in np.unique(street.instance[frame]):
            assert label == 0 or set(classes[street.instance[frame] == label]) == {kinds[label]}


def test_views_from_elsewhere_are_exact_too(street: DriveTruth) -> None:
    t_s = float(street.times_s[4])
    pose = street.cameras[4].world_from_camera.copy()
    pose[:3, 3] += pose[:3, 0]
    again, beside = street.views([street.cameras[4], street.cameras[4].at(pose)], [t_s, t_s])
    assert (again.frame == street.frames[4]).mean() > 0.999  # the way to the map and back rounds
    np.testing.assert_allclose(again.depth_m, street.depth_m[4], rtol=1e-5)
    assert (beside.frame != again.frame).mean() > 0.5


@pytest.mark.parametrize("seed", range(4))
def test_every_street_is_bright_textured_and_has_near_traffic(seed: int) -> None:
    street = make_street(seed, 2, size=(160, 96))
    grey = street.frames[0].astype(float).mean(-1)
    assert 50 < grey.mean() < 200
    assert np.abs(np.diff(grey, axis=1))[~street.sky[0][:, 1:]].mean() > 3
    assert len(np.unique(street.instance)) >= 4
    assert (street.moving[0] & (street.depth_m[0] < 25)).sum() > 30


def test_a_standing_camera_and_an_empty_street() -> None:
    street = make_street(0, 2, size=(64, 48), movers=0, parked=0, speed_m_s=0.0)
    assert street.boxes == ()
    assert not street.moving.any()
    assert street.trajectory.length_m < 0.01


def test_as_many_boxes_as_asked_for() -> None:
    layout = draw_street(4, StreetOptions(1.0, movers=3, parked=5))
    moving = [is_moving(box.track) for box in layout.boxes]
    assert moving == [True] * 3 + [False] * 5


@pytest.mark.slow
def test_surround_cameras_see_the_street_beside_and_behind() -> None:
    layout = draw_street(3)
    world = World(layout)
    front, back = (drive(layout, 2, size=(64, 48), world=world, mount=mount) for mount in ("front", "back"))
    towards = [np.linalg.inv(d.world_from_map)[:2, 2] for d in (front, back)]
    assert towards[0] @ towards[1] == pytest.approx(-1, abs=1e-3)
    assert (front.frames[0] != back.frames[0]).mean() > 0.5


def test_nonsense_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot drive 0 frames"):
        drive(draw_street(0), 0)
    with pytest.raises(ValueError, match="cannot draw"):
        draw_street(0, StreetOptions(seconds=0))


def test_the_ground_plane_gives_the_depth_of_the_road(street: DriveTruth) -> None:
    depth = street.ground.depth_m(street.cameras[0])
    road = street.semantic[0] == Semantic.ROAD
    road[:70] = False
    np.testing.assert_allclose(depth[road], street.depth_m[0][road], rtol=1e-4)
