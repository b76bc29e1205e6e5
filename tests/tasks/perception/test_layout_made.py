"""Samples of a scene whose frames a map-conditioned prior drew, with the labels of the drive that it drew."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.export import export_world
from dreamdrive.generate import generate
from dreamdrive.options import QUALITIES
from dreamdrive.prior.street import StreetSource, map_from_cameras, read_street
from dreamdrive.run import codec
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.street.log import Log, box_corners
from dreamdrive.scene.street.truth import DriveTruth, Mount, Semantic
from dreamdrive.stored import load_scene
from dreamdrive.tasks.perception import (
    BevGrid,
    BevSample,
    ImageSize,
    PathOptions,
    SampleNote,
    draw_places,
    samples_of_scene,
)
from dreamdrive.tasks.perception.bev_set import SampleCamera
from streetworld import StreetOptions, World, WorldView, draw_street, drive, pictures
from streetworld.prior import STREET_WORLD
from tests.test_generate import shorten

Made = tuple[SampleNote, BevSample]
MOUNTED: tuple[Mount, ...] = ("front", "front_left")
SIZE = (96, 64)
IMAGE, GRID = ImageSize(SIZE[1], SIZE[0], 0), BevGrid(200, 200)
FRAMES, FIRST = 6, 1
STEP = 2
"""Time step of the clip that is looked at: 0.3 s of the log, between two labels."""


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A level street as a data set; its car nods and rolls a little."""
    layout = draw_street(4, StreetOptions(seconds=FRAMES / 10))
    world = World(layout)
    seen: dict[Mount, DriveTruth] = {
        m: drive(layout, FRAMES, 10.0, SIZE, world=world, mount=m, antialiased=False) for m in MOUNTED
    }
    folder = tmp_path_factory.mktemp("drawn") / "street"
    export_world(seen, "street", folder)
    return folder


@pytest.fixture(scope="module")
def log(written: Path) -> Log:
    return read_nuscenes(written, "street")


@pytest.fixture(scope="module")
def street(written: Path) -> StreetSource:
    return read_street(STREET_WORLD.open(Control(written)), written, without="all")


@pytest.fixture(scope="module")
def out(written: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What generate makes of the map, the boxes and the cameras."""
    control = Control(written, cameras="all", frames=f"{FIRST}:{FRAMES}", size=SIZE)
    folder = tmp_path_factory.mktemp("made") / "out"
    with pytest.MonkeyPatch.context() as patch:
        shorten(patch)
        options = replace(QUALITIES["draft"], knowledge="none")
        generate(control, folder, prior="street-world", options=options)
    return folder


@pytest.fixture(scope="module")
def sample(out: Path, log: Log) -> Made:
    """The sample at the place and time of a step of the clip."""
    time_s, path = (FIRST + STEP) / 10, PathOptions(aside_m=0.0, turned_deg=0.0, least_covered=0.0)
    places, _ = draw_places(log, (time_s, time_s + 1e-9), 1, path, seed=0)
    (made,) = samples_of_scene(load_scene(out / "scene"), log, places, IMAGE, GRID, path)
    assert made is not None
    return made


@pytest.fixture(scope="module")
def clip(out: Path) -> Clip:
    return codec.read(out / "stages" / "prior", Clip)


@pytest.fixture(scope="module")
def drawn(street: StreetSource, clip: Clip) -> dict[str, WorldView]:
    """The truth of that step's frames by camera, which knows nothing of the log."""
    time_s = (FIRST + STEP) / 10
    poses = map_from_cameras(street, np.array([time_s]))[0]
    placed = [camera.at(pose) for camera, pose in zip(clip.rig, poses, strict=True)]
    seen = pictures(World(street.layout), placed, [time_s] * 2, placed, [time_s] * 2, antialiased=False)
    return dict(zip(clip.provenance["cameras"], seen, strict=True))


def psnr(picture: np.ndarray, other: np.ndarray) -> float:
    return float(-10 * np.log10(np.mean((picture / 255.0 - other / 255.0) ** 2)))


def box_pixels(corners: np.ndarray, camera: SampleCamera, world_from_ego: np.ndarray) -> np.ndarray:
    """Pixels of a sample's picture that a box in the world of the log covers."""
    seen = corners - world_from_ego[:3, 3]
    local = seen @ world_from_ego[:3, :3] @ np.array(camera.camera_from_ego)[:3, :3].T
    local += np.array(camera.camera_from_ego)[:3, 3]
    mask = np.zeros(SIZE[::-1], np.uint8)
    if local[:, 2].min() > 0.2:
        pixels = local @ np.array(camera.pixel_from_camera).T
        hull = cv2.convexHull(np.rint(pixels[:, :2] / pixels[:, 2:]).astype(np.int32))
        cv2.fillConvexPoly(mask, hull, 1)
    return mask > 0


def test_a_sample_says_which_prior_made_its_frames(sample: Made) -> None:
    assert (sample[0].kind, sample[0].prior) == ("rendered", "street-world")


def test_a_sample_shows_the_frame_of_its_time(sample: Made, clip: Clip) -> None:
    """Frames 0.1 s before and behind are less alike."""
    note, made = sample
    for camera, picture in zip(note.cameras, made.pictures, strict=True):
        frames = clip.frames[clip.of_camera(clip.provenance["cameras"].index(camera.name))]
        alike = [psnr(picture.transpose(1, 2, 0), frame) for frame in frames]
        assert int(np.argmax(alike)) == STEP
        assert alike[STEP] > 25


def test_labelled_boxes_lie_on_the_pixels_of_what_is_drawn(
    sample: Made, log: Log, street: StreetSource, drawn: dict[str, WorldView]
) -> None:
    """Nothing is seen outside of its box, and what nothing hides fills more than half of it."""
    note, _ = sample
    ego = np.array(note.world_from_ego)
    seen = whole = 0
    instances = {mover.box.id: mover.instance for mover in World(street.layout).movers}
    for track, box in zip(log.boxes, street.layout.boxes, strict=True):
        pose = track.pose_at(note.time_s)
        assert pose is not None
        corners = box_corners(pose, track.size_lwh_m[0])
        for camera in note.cameras:
            shown = drawn[camera.name].instance == instances[box.id]
            covered = box_pixels(corners, camera, ego)
            if shown.sum() > 40:
                seen += 1
                whole += int(shown.sum() > 0.5 * covered.sum())
                assert (shown & covered).sum() >= 0.98 * shown.sum(), (box.id, camera.name)
    assert seen >= 6
    assert whole >= 5


def test_road_and_vehicles_are_labelled_where_they_are_drawn(
    sample: Made, clip: Clip, drawn: dict[str, WorldView]
) -> None:
    """The points behind the pixels, by the depth of what is drawn, and the cells that they lie in."""
    note, made = sample
    kernel = np.ones((5, 5), np.uint8)  # outlines are rounded to cells, and so are points
    road, vehicle = made.labels.road(), made.labels.vehicle()
    inside, near = cv2.erode(road, kernel), cv2.dilate(road, kernel)
    near_vehicle = cv2.dilate(vehicle, kernel)
    counts = Counter[str]()
    for index, camera in enumerate(note.cameras):
        view, pinhole = drawn[camera.name], clip.rig[clip.provenance["cameras"].index(camera.name)]
        points = pinhole.rays() * view.depth_m[..., None]
        ego_from_camera = np.linalg.inv(made.camera_from_ego[index].astype(float))
        points = points @ ego_from_camera[:3, :3].T + ego_from_camera[:3, 3]
        ground = np.concatenate([points[..., :2], np.ones((*view.depth_m.shape, 1))], axis=2)
        column, row = np.moveaxis(np.rint(ground @ GRID.pixels_from_ego().T[:, :2]).astype(int), 2, 0)
        there = (view.depth_m > 0) & (view.depth_m < 30)
        there &= (row >= 0) & (row < GRID.rows) & (column >= 0) & (column < GRID.columns)
        kinds = {
            "road": (np.isin(view.semantic, [Semantic.ROAD, Semantic.MARKING]), near > 0),
            "beside": (np.isin(view.semantic, [Semantic.SIDEWALK, Semantic.GRASS]), inside == 0),
            "vehicle": (
                np.isin(view.semantic, [Semantic.CAR, Semantic.VAN, Semantic.TRUCK]),
                near_vehicle > 0,
            ),
        }
        for name, (shown, labelled) in kinds.items():
            shown = shown & there
            counts[name] += int(shown.sum())
            assert labelled[row[shown], column[shown]].all(), (name, camera.name)
    assert min(counts.values()) > 200, counts
