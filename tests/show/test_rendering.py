"""Drives as videos, pictures and arrays: sizes, parts, exact values, and what is never overwritten."""

import json
from dataclasses import replace
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
import torch

from dreamdrive.data import read_trajectory
from dreamdrive.data.cameras.intrinsics import read_intrinsics
from dreamdrive.drive.drives import Drive
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files.depth import read_depth
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show import panels
from dreamdrive.show.rendering import (
    RenderOptions,
    depth_png,
    video_rate,
    view_camera,
    write_drive,
)
from dreamdrive.splat.scene_view import SceneView, render_scene
from dreamdrive.trust import SceneTrust
from dreamdrive.vision.residual import BLOCK_PX
from tests.scene.scenes import make_scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return make_scene()


@pytest.fixture(scope="module")
def drive() -> Drive:
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 2, 3] = np.arange(3) - 6
    return Drive("mine", Trajectory(poses, np.arange(3) / 10 + 0.35))


def nothing(done: int) -> None:
    del done


def view(scene: Scene, drive: Drive, i: int, part: str = "all") -> SceneView:
    camera = scene.cameras[0].at(drive.path.world_from_camera[i])
    return render_scene(scene, camera, float(drive.path.times_s[i]), part=part)  # pyright: ignore


def test_another_size_keeps_the_field_of_view_and_the_shape_of_pixels() -> None:
    camera = Camera(100.0, 110.0, 90.0, 50.0, 200, 120)
    assert view_camera(camera, None) is camera
    assert view_camera(camera, (400, 120)) == Camera(
        200.0, 220.0, 180.0, 50.0, 400, 120, camera.world_from_camera
    )
    assert view_camera(camera, (400, 240)).matrix.tolist() == camera.resized(400, 240).matrix.tolist()


def test_a_larger_size_shows_the_same(scene: Scene, drive: Drive, tmp_path: Path) -> None:
    write_drive(tmp_path / "large", scene, drive, RenderOptions(format="png", size=(99, 72)), nothing)
    large = cv2.imread(str(tmp_path / "large" / "0001.png"))
    assert large is not None
    small = panels.to_bytes(view(scene, drive, 1).colour.numpy())[..., ::-1]
    shrunk = cv2.resize(large, (33, 24), interpolation=cv2.INTER_AREA)
    assert np.abs(shrunk.astype(float) - small).mean() < 6


def test_rates_are_the_drives_own_or_the_wanted(drive: Drive) -> None:
    assert video_rate(drive, RenderOptions()) == pytest.approx(10)
    assert video_rate(drive, RenderOptions(fps=7.0)) == 7
    fast = Drive("fast", Trajectory(drive.path.world_from_camera, np.arange(3) * 1e-6))
    with pytest.raises(InputError) as error:
        video_rate(fast, RenderOptions())
    assert str(error.value) == (
        "--trajectory fast has 1e+06 poses a second, and a video 0.1 to 240 frames: give --fps"
    )


@pytest.mark.parametrize("show", ["colour", "static", "dynamic"])
def test_pictures_and_arrays_hold_exactly_what_is_rendered(
    scene: Scene, drive: Drive, tmp_path: Path, show: str
) -> None:
    done: list[int] = []
    options = RenderOptions(show, "png")  # pyright: ignore
    write_drive(tmp_path / "png", scene, drive, options, done.append)
    write_drive(tmp_path / "npz", scene, drive, replace(options, format="npz"), nothing)
    assert done == [1, 2, 3]
    assert sorted(p.name for p in (tmp_path / "png").glob("[!.]*")) == [
        *(f"{i:04d}.png" for i in range(3)),
        "render.json",
    ]
    for i in range(3):
        expected = view(scene, drive, i, "all" if show == "colour" else show)
        picture = cv2.imread(str(tmp_path / "png" / f"{i:04d}.png"))
        assert picture is not None
        np.testing.assert_array_equal(picture[..., ::-1], panels.to_bytes(expected.colour.numpy()))
        with np.load(tmp_path / "npz" / f"{i:04d}.npz") as arrays:
            assert {name: (a.dtype, a.shape) for name, a in arrays.items()} == {
                "colour": (np.float32, (24, 33, 3)),
                "depth_m": (np.float32, (24, 33)),
                "alpha": (np.float32, (24, 33)),
            }
            np.testing.assert_array_equal(arrays["colour"], expected.colour.numpy())
            np.testing.assert_array_equal(arrays["depth_m"], expected.depth_m.numpy())
            np.testing.assert_array_equal(arrays["alpha"], expected.alpha.numpy())


def test_parts_differ(scene: Scene, drive: Drive) -> None:
    colours = [view(scene, drive, 1, part).colour for part in ("all", "static", "dynamic")]
    assert not torch.equal(colours[0], colours[1])
    assert not torch.equal(colours[1], colours[2])


def test_depth_is_read_back_in_metres(scene: Scene, drive: Drive, tmp_path: Path) -> None:
    write_drive(tmp_path / "png", scene, drive, RenderOptions("depth", "png"), nothing)
    write_drive(tmp_path / "npz", scene, drive, RenderOptions("depth", "npz"), nothing)
    depth_m, _ = read_depth(tmp_path / "png" / "0002.png", 1 / 256)
    with np.load(tmp_path / "npz" / "0002.npz") as arrays:
        assert sorted(arrays) == ["alpha", "depth_m"]
        assert arrays["depth_m"].max() > 3
        assert np.abs(depth_m - arrays["depth_m"]).max() <= 0.5 / 256
    assert json.loads((tmp_path / "png" / "render.json").read_text())["depth_unit"] == "1/256 m"


def test_depth_beyond_16_bits_stays_the_farthest() -> None:
    row = torch.tensor([[0.0, 0.5, 255.9, 256.0, 1e6]])
    far = SceneView(torch.zeros(1, 5, 3), row, row, row, torch.zeros(1, 5, 0))
    assert depth_png(far).tolist() == [[0, 128, 65510, 65535, 65535]]


def test_a_video_of_depth_has_the_colours_of_the_panel(scene: Scene, drive: Drive, tmp_path: Path) -> None:
    large = replace(scene, cameras=tuple(c.resized(132, 96) for c in scene.cameras))
    write_drive(tmp_path / "a.mp4", large, drive, RenderOptions("depth", fps=4.0), nothing)
    with av.open(str(tmp_path / "a.mp4")) as container:
        assert container.streams.video[0].average_rate == 4
        shown = [
            frame.reformat(format="rgb24", src_colorspace="ITU709").to_ndarray()
            for frame in container.decode(video=0)
        ]
    wanted = panels.depth_colours(view(large, drive, 1).depth_m.numpy())
    assert np.abs(shown[1].astype(float) - wanted).mean() < 8


def test_the_note_is_a_calibration_and_a_trajectory(scene: Scene, drive: Drive, tmp_path: Path) -> None:
    write_drive(tmp_path / "a", scene, drive, RenderOptions(format="npz", size=(66, 40)), nothing)
    found = read_intrinsics(tmp_path / "a" / "render.json", (66, 40)).camera
    np.testing.assert_array_equal(found.matrix, view_camera(scene.cameras[0], (66, 40)).matrix)
    np.testing.assert_array_equal(
        read_trajectory(tmp_path / "a" / "render.json").world_from_camera, drive.path.world_from_camera
    )


def test_an_earlier_result_is_replaced_and_nothing_else(scene: Scene, drive: Drive, tmp_path: Path) -> None:
    folder = tmp_path / "a"
    write_drive(folder, scene, drive, RenderOptions(format="npz"), nothing)
    write_drive(
        folder,
        scene,
        replace(drive, path=Trajectory(np.eye(4)[None], np.zeros(1))),
        RenderOptions(format="png"),
        nothing,
    )
    assert sorted(p.name for p in folder.glob("[!.]*")) == ["0000.png", "render.json"]
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(InputError) as error:
        write_drive(folder, scene, drive, RenderOptions(format="png"), nothing)
    assert str(error.value).startswith(f"{folder} holds other files (notes.txt), and is not replaced")
    own = tmp_path / "photos"
    own.mkdir()
    (own / "0000.png").write_text("mine")
    with pytest.raises(InputError) as error:
        write_drive(own, scene, drive, RenderOptions(format="png"), nothing)
    assert str(error.value).startswith(f"{own} holds other files (it is no rendered drive of dreamdrive's)")
    assert (own / "0000.png").read_text() == "mine"


def test_a_failure_half_way_leaves_nothing(scene: Scene, drive: Drive, tmp_path: Path) -> None:
    def stop(done: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    for options, name in (
        (RenderOptions(), "a.mp4"),
        (RenderOptions(format="png"), "a"),
        (RenderOptions(format="npz"), "b"),
    ):
        with pytest.raises(KeyboardInterrupt):
            write_drive(tmp_path / name, scene, drive, options, stop)
    assert list(tmp_path.iterdir()) == []


def test_trust_fades_pictures_to_red_and_is_kept_in_arrays(
    scene: Scene, drive: Drive, tmp_path: Path
) -> None:
    camera = scene.cameras[0]
    blocks = len(scene.cameras), camera.height_px // BLOCK_PX, camera.width_px // BLOCK_PX
    known = replace(scene, residual=np.full(blocks, 0.02, np.float16))
    trust = SceneTrust.of(known)
    for format in ("png", "npz"):
        options = RenderOptions("trust", format)
        write_drive(tmp_path / format, known, drive, options, nothing, trust)
    seen = trust.view(camera.at(drive.path.world_from_camera[1]), float(drive.path.times_s[1]))
    with np.load(tmp_path / "npz" / "0001.npz") as arrays:
        np.testing.assert_allclose(arrays["trust"], seen.trust, rtol=1e-5)
        assert set(arrays.files) == {"colour", "depth_m", "alpha", "trust"}
    note = json.loads((tmp_path / "png" / "render.json").read_text())
    assert note["expected_psnr_db"][1] == pytest.approx(seen.psnr_db, abs=1e-4)
    picture = cv2.cvtColor(cv2.imread(str(tmp_path / "png" / "0001.png")), cv2.COLOR_BGR2RGB)
    assert np.array_equal(picture, panels.trust_colours(seen.view.picture, seen.trust))


def test_colours_of_trust() -> None:
    image = np.full((20, 28, 3), 100, np.uint8)
    trusted = panels.trust_colours(image, np.ones((2, 3)))
    assert np.array_equal(trusted, image)
    left = np.ones((2, 3))
    left[:, 0] = 0
    half = panels.trust_colours(image, left).astype(int)
    assert (half[:, 0, 0] > 140).all()
    assert (half[:, 0, 2] < 80).all()
    assert np.array_equal(half[:, -1], image[:, -1])
