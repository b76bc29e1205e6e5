"""What notebooks show of scenes, looks, trajectories and outcomes."""

import base64
import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.run.report.outcome import Outcome
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.look import CameraEstimate, Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show import card
from dreamdrive.show.look import COLOURS
from dreamdrive.splat import render_scene
from tests.scene.scenes import make_scene


def picture(html: str) -> np.ndarray:
    """The picture inside a text, RGB."""
    data = re.findall(r'src="data:image/jpeg;base64,([^"]+)"', html)
    assert len(data) == 1
    decoded = cv2.imdecode(np.frombuffer(base64.b64decode(data[0]), np.uint8), cv2.IMREAD_COLOR)
    return cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB)


def rows(html: str) -> dict[str, str]:
    return dict(re.findall(r"<tr><th[^>]*>(.*?)</th><td[^>]*>(.*?)</td></tr>", html))


def test_a_scene_shows_its_middle_view_and_its_numbers() -> None:
    scene = make_scene()
    html = scene._repr_html_()
    told = rows(html)
    assert told["Gaussians"] == "7 of what stands, 4 of what moves"
    assert told["actors"] == ", ".join(actor.name for actor in scene.actors)
    assert told["recorded"].startswith(f"{len(scene.cameras)} views, {scene.held_out.sum()} held out")
    seen = picture(html)
    middle = len(scene.cameras) // 2
    wanted = render_scene(scene, scene.cameras[middle], float(scene.times_s[middle])).picture
    half = cv2.resize(seen[:, : seen.shape[1] // 2], wanted.shape[1::-1], interpolation=cv2.INTER_AREA)
    assert np.abs(half.astype(float).mean((0, 1)) - wanted.mean((0, 1))).max() < 12


def test_a_trajectory_is_seen_from_above_with_its_length_and_speed() -> None:
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, 2, 3] = np.arange(5) * 5.0
    html = Trajectory(poses, np.arange(5) * 0.5)._repr_html_()
    assert rows(html) == {"poses": "5", "drive": "20.0 m in 2.00 s, 36 km/h in the mean"}
    red = picture(html).astype(int)
    where = np.argwhere((red[..., 0] > 150) & (red[..., 1] < 100))
    assert np.ptp(where[:, 0]) > 200 > 10 > np.ptp(where[:, 1])  # straight ahead is up


def test_one_pose_has_no_speed() -> None:
    assert rows(Trajectory(np.eye(4)[None], np.zeros(1))._repr_html_())["drive"] == "0.0 m in 0.00 s"


def test_a_look_shows_classes_and_depth_and_counts_road_users() -> None:
    camera = CameraEstimate(16, 8, 8.0, 0.1, 0.0, 1.0, 0.0, 0.1, 0.0)
    classes = np.full((2, 8, 16), StreetClass.ROAD, np.uint8)
    users = tuple((RoadUser(StreetClass.VEHICLE, 0.9, (0, 0, 2, 2), 4),) for _ in range(2))
    ones = np.ones((2, 8, 16))
    look = Look(
        4 * ones, ones, classes, ones, np.zeros((2, 8, 16), np.uint16), users, (camera, camera), camera
    )
    html = look._repr_html_()
    assert rows(html)["road users"] == "2 x vehicle"
    assert rows(html)["camera"].startswith("field of view 90°")
    assert rows(html)["depth in"] == "camera heights"
    assert rows(replace(look, camera_height_m=1.5)._repr_html_())["depth in"] == "heights of 1.5 m"
    left = picture(html)[:, 100:200].reshape(-1, 3).mean(0)
    assert np.abs(left - COLOURS[StreetClass.ROAD]).max() < 8


@pytest.fixture
def outcome() -> Outcome:
    return Outcome(False, 24, (96, 64), 700, 0, 0, {"fit": 3.0}, 0, None, None, ("it <guessed>",), ("known",))


def test_an_outcome_shows_its_lines_and_the_report_s_picture(tmp_path: Path, outcome: Outcome) -> None:
    told = rows(outcome._repr_html_())
    assert told["made"].startswith("a scene of 700 Gaussians")
    assert "&lt;guessed&gt;" in told["rough"]
    assert "<img" not in outcome._repr_html_()
    cv2.imwrite(str(tmp_path / "report.png"), np.full((100, 1800, 3), (200, 60, 20), np.uint8))
    seen = picture(replace(outcome, picture=tmp_path / "report.png")._repr_html_())
    assert seen.shape == (50, 900, 3)
    assert np.abs(seen.reshape(-1, 3).mean(0) - (20, 60, 200)).max() < 8


def test_texts_are_escaped() -> None:
    assert "<script>" not in card("a<script>", {"<script>": "<script>"})


def test_frames_along_a_path_are_those_of_render_scene() -> None:
    scene: Scene = make_scene()
    path = Trajectory(np.stack([camera.world_from_camera for camera in scene.cameras]), scene.times_s)
    frames = scene.render(path)
    camera = scene.cameras[0]
    assert frames.dtype == np.uint8
    assert frames.shape == (len(path), camera.height_px, camera.width_px, 3)
    wanted = render_scene(scene, camera.at(path.world_from_camera[-1]), float(path.times_s[-1])).picture
    assert np.array_equal(frames[-1], wanted)
    assert scene.render(path, size=(32, 20)).shape == (len(path), 20, 32, 3)
