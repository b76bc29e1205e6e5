"""The list of drives, what is known of them, and the table."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive import Given, build_scene, options
from dreamdrive_bench.common.recorder import Recorder
from dreamdrive_bench.drives import main, truth
from dreamdrive_bench.drives.drive import Drive, drives
from dreamdrive_bench.drives.measure import sheet_of
from tests.decompose.test_per_frame import wall


def test_the_list_names_each_drive_once() -> None:
    listed = drives()
    assert len(listed) >= 30
    assert len({(drive.place, drive.source, drive.frames) for drive in listed.values()}) == len(listed)
    assert all(drive.truth in (None, "kitti", "pandaset", "camvid") for drive in listed.values())


def test_a_drive_that_is_not_here_is_looked_for_where_it_is_brought_to() -> None:
    drive = Drive("x", "drives/nowhere", "frames", "0:3:1", (8, 8))
    assert drive.folder == Path("runs/data/drives/nowhere")


def test_label_maps_tell_what_moves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clip, _ = wall()
    drive = Drive("x", str(tmp_path), "frames", "0:8:1", clip.size, truth="camvid")
    (tmp_path / "labels").mkdir()
    for i in range(len(clip)):
        labels = np.zeros(clip.frames.shape[1:3], np.uint8)
        labels[:, :10], labels[:, 10:20], labels[:, 20:30] = 8, 9, 10
        cv2.imwrite(str(tmp_path / "labels" / f"{i:06d}.png"), labels)
    found = truth.movers_of(drive, clip)
    assert found is not None
    assert found.counted[:, :, :10].all()
    assert found.counted[:, :, 20:30].all()
    assert not found.counted[:, :, 30:].any()
    assert found.ignored.any(axis=(0, 1)).nonzero()[0].tolist() == list(range(10, 20))
    assert truth.path_figures(drive, clip, wall()[1]) == {}


def test_what_a_run_computes_is_kept_with_its_seconds() -> None:
    run = Recorder()
    assert run("look", None, lambda work: 3) == 3
    assert run("geometry", None, lambda work: 4, given=5) == 5
    assert run.results == {"look": 3, "geometry": 5}
    assert set(run.seconds) == {"look", "geometry"}


def test_the_table_has_a_line_a_run_and_the_means() -> None:
    rows = [
        {"name": "a", "knowledge": "twin", "psnr": 20.0, "flow_interpolation_psnr": 18.0, "maps": True},
        {"name": "b", "knowledge": "twin", "psnr": 24.0, "flow_interpolation_psnr": 25.0, "maps": False},
        {"name": "a", "knowledge": "none", "psnr": 21.0, "maps": True, "drifts": True, "seconds": 9.4},
    ]
    text = main.tables(rows, ["twin", "none"])
    assert "| b | twin | 24.00 | 25.00 | - | - | - | - | - | no | - |" in text
    assert "| a | none | 21.00 | - | - | - | - | - | - | drifts | 9 |" in text
    assert "| mean | twin | 22.00 | 21.50 | - | - | - | - | - | 0.50 | - |" in text


@pytest.mark.slow
def test_a_sheet_shows_held_out_frames_and_those_before() -> None:
    clip, geometry = wall()
    tiny = options.QUALITIES["draft"]
    scene = build_scene(clip, tiny, given=Given(geometry=geometry)).scene
    shares = np.zeros(geometry.depth_m.shape, np.float32)
    height, width = clip.frames.shape[1:3]
    assert sheet_of(clip, geometry, scene, shares).shape == (2 * height, 5 * width, 3)
