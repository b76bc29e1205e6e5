"""A true video scores better than a corrupted one, and a wrong path is measured at its size."""

import json
from dataclasses import asdict

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.evaluate.consistency import GAPS, Consistency, evaluate_consistency
from dreamdrive.geometry.cameras import sfm
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.scene.trajectory import Trajectory
from streetworld import make_street
from streetworld.corruption import Corruption, corrupt, parse_corruption


def evaluate(
    street: DriveTruth, frames: np.ndarray, asked: Trajectory | None, **options: object
) -> Consistency:
    times_s = street.times_s[: len(frames)]
    return evaluate_consistency(frames, times_s, street.cameras[0], asked, **options)  # type: ignore[arg-type]


def worse(bad: Consistency, good: Consistency) -> list[str]:
    """Names of the figures of ``bad`` that are no worse than those of ``good``."""
    assert bad.path is not None
    assert good.path is not None
    pairs = {
        name: (getattr(bad.path, name), getattr(good.path, name))
        for name in ("ate_m", "translation_percent", "rotation_deg_per_m")
    }
    for one, two in zip(bad.gaps, good.gaps, strict=True):
        pairs[f"epipolar {one.gap}"] = (-one.epipolar.share, -two.epipolar.share)  # type: ignore[union-attr, operator]
        pairs[f"warp {one.gap}"] = (one.warp.grey_levels, two.warp.grey_levels)  # type: ignore[union-attr]
    assert len(pairs) == 3 + 2 * len(GAPS)
    return [name for name, (b, g) in pairs.items() if not b > g]


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return make_street(seed=1, frames=10, size=(160, 96))


@pytest.fixture(scope="module")
def clean(street: DriveTruth) -> Consistency:
    return evaluate(street, street.frames, street.trajectory, moving=street.moving)


def test_the_truth_scores_well(clean: Consistency) -> None:
    assert clean.found_by == "structure from motion"
    assert clean.lines_from == "asked"
    assert clean.notes == ()
    assert clean.path is not None
    assert clean.path.translation_percent < 0.6
    assert clean.path.rotation_deg_per_m < 0.02
    assert [gap.gap for gap in clean.gaps] == list(GAPS)
    # Rows of equal windows are taken for one another, the more so the further apart the frames.
    for gap, least in zip(clean.gaps, (0.95, 0.9, 0.75), strict=True):
        assert gap.epipolar is not None
        assert gap.epipolar.share is not None
        assert gap.epipolar.share > least


def test_a_corrupted_video_scores_worse_on_every_figure(street: DriveTruth, clean: Consistency) -> None:
    frames = corrupt(street.frames, Corruption(1, 1, 1, 1, 1), street.depth_m)
    assert worse(evaluate(street, frames, street.trajectory, moving=street.moving), clean) == []


def test_without_structure_from_motion_the_path_is_that_of_odometry(
    street: DriveTruth, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sfm, "map_globally", lambda *_: None)
    found = evaluate(street, street.frames, street.trajectory, moving=street.moving)
    assert found.found_by == "odometry"
    assert found.path is not None
    assert found.path.rotation_deg_per_m < 0.1


@pytest.mark.slow
def test_the_preset_scores_worse_on_every_figure() -> None:
    street = make_street(seed=1, frames=12, size=(256, 160))
    frames = corrupt(street.frames, parse_corruption("generated"), street.depth_m)
    clean = evaluate(street, street.frames, street.trajectory, moving=street.moving)
    bad = evaluate(street, frames, street.trajectory, moving=street.moving)
    assert worse(bad, clean) == []


def test_the_same_frames_give_the_same_figures(street: DriveTruth) -> None:
    first, second = (evaluate(street, street.frames[:4], None) for _ in range(2))
    assert first == second
    assert first.found_by == "structure from motion"


def test_a_wrong_path_is_measured_at_its_size(street: DriveTruth, clean: Consistency) -> None:
    poses, travelled = street.trajectory.world_from_camera.copy(), [0.0]
    travelled += np.cumsum(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)).tolist()
    turns = Rotation.from_euler("y", 0.4 * np.array(travelled)[:, None], degrees=True).as_matrix()
    poses[:, :3, :3] = poses[:, :3, :3] @ turns
    poses[:, :3, 3] *= 1.2
    found = evaluate(street, street.frames, Trajectory(poses, street.times_s), moving=street.moving)
    assert found.path is not None
    assert clean.path is not None
    assert found.path.rotation_deg_per_m == pytest.approx(0.4 / 1.2, rel=0.05)
    assert found.path.scale == pytest.approx(1.2 * clean.path.scale, rel=1e-6)
    assert found.path.ate_percent == pytest.approx(clean.path.ate_percent, rel=1e-6)
    for one, two in zip(found.gaps[1:], clean.gaps[1:], strict=True):
        assert one.epipolar.share < two.epipolar.share - 0.05  # type: ignore[union-attr, operator]


def test_a_video_that_stands_misses_the_whole_path(street: DriveTruth) -> None:
    frames = np.repeat(street.frames[:1], 10, axis=0)
    found = evaluate(street, frames, street.trajectory)
    assert found.found_by == "standing"
    assert found.path is not None
    assert found.path.translation_percent == pytest.approx(100, abs=1)
    assert all(gap.warp is not None and gap.warp.grey_levels == 0 for gap in found.gaps)


def test_few_frames_leave_out_what_they_cannot_show(street: DriveTruth) -> None:
    cut = Trajectory(street.trajectory.world_from_camera[:3], street.times_s[:3])
    found = evaluate(street, street.frames[:3], cut)
    assert [gap.warp is None for gap in found.gaps] == [False, True, True]
    assert [gap.epipolar is None for gap in found.gaps] == [False, True, True]
    assert "3 frames are too few for pairs 4 and 8 frames apart." in found.notes
    text = json.dumps(asdict(found), allow_nan=False)
    assert json.loads(text)["gaps"][2] == {"gap": 8, "epipolar": None, "warp": None}


def test_without_a_path_the_lines_are_those_found(street: DriveTruth) -> None:
    found = evaluate(street, street.frames[:6], None)
    assert found.path is None
    assert found.lines_from == "found"
    assert found.gaps[0].epipolar is not None
    assert found.gaps[0].epipolar.share > 0.9  # type: ignore[operator]
    assert any("No path was asked for" in note for note in found.notes)


def test_blank_frames_show_no_path(street: DriveTruth) -> None:
    frames = np.full_like(street.frames, 90)
    found = evaluate(street, frames, street.trajectory)
    assert found.path is None
    assert found.found_by is None
    assert found.gaps[0].epipolar is not None
    assert found.gaps[0].epipolar.share is None
    assert any("too little to follow" in note for note in found.notes)


def test_what_cannot_be_measured_is_refused(street: DriveTruth) -> None:
    with pytest.raises(InputError, match="got 1 frames; expected at least two"):
        evaluate(street, street.frames[:1], None)
    with pytest.raises(InputError, match="has 10 poses but the video has 6 frames"):
        evaluate(street, street.frames[:6], street.trajectory)
    with pytest.raises(ValueError, match="intrinsics of 160x96 for frames of 80x48"):
        evaluate(street, street.frames[:, ::2, ::2].copy(), None)
