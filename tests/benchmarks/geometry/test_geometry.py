"""The geometry benchmark: which measurements there are, errors, tables."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dreamdrive.geometry.backends.dust3r.align.alignment import align, predicted_bytes
from dreamdrive.geometry.backends.dust3r.pairs import make_pairs
from dreamdrive_bench.common.drawn import drawn_clip, write_cameras
from dreamdrive_bench.geometry import alignment, backends, cases, jobs, main, memory_run, report, worlds
from dreamdrive_bench.geometry.simulated_pairs import Noise, Truth, pair_maps


@pytest.fixture
def truth() -> Truth:
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, 2, 3] = [0.0, 1.0, 2.0, 3.0]
    return Truth(np.full((4, 6, 8), 10.0), poses, focal_px=7.0)


def test_each_measurement_has_a_file_of_its_own() -> None:
    for quick in (False, True):
        wanted = jobs.everything(quick=quick)
        assert len({cases.result_of(job, Path("runs")) for job in wanted}) == len(wanted)
        assert {type(job).__name__ for job in wanted} >= {"Alignment", "BackendRun", "MemoryRun"}
    assert len(jobs.everything(quick=True)) < 10


def test_patterns_choose_and_order() -> None:
    wanted = jobs.everything(quick=True)
    assert main.chosen(wanted, None) == wanted
    assert [job.name.split("-")[0] for job in main.chosen(wanted, ["memory-*", "backend-*"])] == [
        "memory",
        "backend",
        "backend",
    ]


def test_a_way_turns_a_quarter_of_a_circle() -> None:
    way = worlds.turned(np.array([1.0, 2.0, 0.0]), 10.0, 1, 8.0, np.array([0.0, 10.0, 10 + 4 * np.pi, 50.0]))
    np.testing.assert_allclose(way[:3], [[1, 2, 0], [11, 2, 0], [19, 10, np.pi / 2]], atol=1e-9)
    np.testing.assert_allclose(way[3], [19, 10 + 40 - 4 * np.pi, np.pi / 2])
    right = worlds.turned(np.zeros(3), 10.0, -1, 8.0, np.array([10 + 4 * np.pi]))
    np.testing.assert_allclose(right, [[18, -8, -np.pi / 2]], atol=1e-9)


def test_errors_know_neither_the_world_nor_the_unit(truth: Truth) -> None:
    poses = truth.world_from_camera.copy()
    poses[:, :3, 3] = 3 * poses[:, :3, 3] + 5
    found = alignment.errors_of(poses, np.array([7.0, 7.0, 7.7, 7.0]), list(3 * truth.depth), truth)
    assert found["path_percent"] == pytest.approx(0, abs=1e-9)
    assert found["abs_rel"] == pytest.approx(0, abs=1e-9)
    assert found["focal_percent"] == pytest.approx(10)


def test_a_standing_camera_has_no_path_error(truth: Truth) -> None:
    truth.world_from_camera[:, :3, 3] *= 0.1
    poses = truth.world_from_camera
    found = alignment.errors_of(poses, np.full(4, 7.0), list(truth.depth), truth)
    assert found["path_percent"] is None
    assert found["abs_rel"] == 0


def test_alignment_does_not_turn_cameras_of_drawn_pairs() -> None:
    truth = alignment.drawn_truth("straight b", 4, (48, 32))
    exact = Noise(depth=0, scale=0, focal=0, outliers=0, mistaken=False)
    found = align(pair_maps(truth, make_pairs(4, alignment.GRAPH), exact))
    errors = alignment.errors_of(found.world_from_camera, found.focals_px, found.depth, truth)
    assert (
        errors["rpe_percent"] < 0.1
    )  # half a pixel to the side and down would be 100 * 0.7 / focal_px = 1.8


def test_the_memory_curve_is_of_one_graph_and_none_of_it_is_refused() -> None:
    wanted = [job for job in jobs.everything() if isinstance(job, jobs.MemoryRun)]
    curve = [job for job in wanted if (job.size, job.graph, job.dtype) == ((512, 288), jobs.GRAPH, "float32")]
    assert {job.frames for job in curve} == {8, 16, 25, 32, 64, 128}
    for job in curve:
        sizes = [(288, 512)] * job.frames
        assert predicted_bytes(sizes, make_pairs(job.frames, job.graph), 2000) <= 1e9 * job.memory_gb
    assert "4GB" in next(job.name for job in curve if job.frames == 25)


def test_each_hard_case_has_the_authors_beside_it() -> None:
    hard = [job for job in jobs.everything() if getattr(job, "noise", None) == jobs.HARD]
    for method in ("ours", jobs.PAPER, "upstream"):
        assert {job.world for job in hard if job.method == method} == set(jobs.SEEDS)


def test_a_draw_is_a_seed_of_its_own(monkeypatch: pytest.MonkeyPatch, truth: Truth) -> None:
    seeds = []

    class StopError(Exception):
        pass

    def drawn(truth: Truth, edges: Any, noise: Noise, seed: int) -> None:
        seeds.append(seed)
        raise StopError

    monkeypatch.setattr(alignment, "drawn_truth", lambda *_: truth)
    monkeypatch.setattr(alignment, "pair_maps", drawn)
    for world in ("bend a", "standing"):
        for frames in (24, 48):
            for draw in range(3):
                with pytest.raises(StopError):
                    alignment.Alignment(world, "ours", frames, draw=draw).measure(Path())
    assert len(set(seeds)) == len(seeds)


def test_what_does_not_fit_is_refused_with_the_figure() -> None:
    told = memory_run.measure(24, (128, 80), "swin-3-noncyclic", np.float32, 0.1)
    assert "24 images in 132 pairs takes about" in told["refused"]
    case = {
        "frames": 24,
        "size": [128, 80],
        "graph": "swin-3-noncyclic",
        "dtype": "float32",
        "memory_gb": 0.1,
    }
    assert "refused: above 0.1 GB" in report.memory_table([{**case, **told}])


def test_a_drive_is_enlarged_by_blocks(truth: Truth) -> None:
    truth.depth[0, 1, 2] = 20
    found = memory_run.enlarged(truth, 4)
    assert found.depth.shape == (4, 24, 32)
    assert (found.depth[0, 4:8, 8:12] == 20).all()
    assert found.focal_px == 28


def test_true_cameras_are_read_back_as_they_are(tmp_path: Path) -> None:
    made = worlds.world_of("straight a", 2, 10.0, (48, 32), 0)
    file = tmp_path / "cameras.json"
    write_cameras(made, file)
    clip = drawn_clip(made)
    attached = backends.attach(clip, file)
    pinhole, true = attached.rig[0], made.cameras[0]
    assert (pinhole.fx_px, pinhole.cx_px, pinhole.cy_px) == pytest.approx(
        (true.fx_px, true.cx_px, true.cy_px)
    )
    moved = np.linalg.inv(true.world_from_camera) @ made.cameras[1].world_from_camera
    np.testing.assert_allclose(attached.known.world_from_camera[1], moved, atol=1e-9)
