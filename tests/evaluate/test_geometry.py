"""Known errors of cameras and depth come out at their size; what has no meaning is None and said."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.evaluate.estimate import Estimate
from dreamdrive.evaluate.geometry import DepthGroup, GeometryFigures, evaluate_geometry
from dreamdrive.evaluate.truth.geometry import GeometryTruth
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Scale

FRAMES, PINHOLE = 6, Camera(20.0, 20.0, 8.0, 5.0, 16, 10)


def bend(frames: int = FRAMES, step_m: float = 2.0) -> np.ndarray:
    angle = np.linspace(0, 0.1 * (frames - 1), frames)
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("y", angle[:, None]).as_matrix()
    poses[:, :3, 3] = step_m / 0.1 * np.column_stack([1 - np.cos(angle), 0 * angle, np.sin(angle)])
    return poses


def known(poses: np.ndarray | None = None) -> GeometryTruth:
    """Depths from 4 to 100 m and a moving thing in the left half of the rows 2 to 4; sky above."""
    poses = bend() if poses is None else poses
    rows = np.array([0, 0, 100, 60, 30, 18, 12, 8, 6, 4], dtype=np.float32)
    depth_m = np.tile(rows[:, None], (len(poses), 1, 16))
    moving = np.zeros(depth_m.shape, dtype=bool)
    moving[:, 2:5, :8] = True
    return GeometryTruth(tuple(PINHOLE.at(pose) for pose in poses), depth_m, moving)


def found(truth: GeometryTruth, scale: float = 1.0, move: np.ndarray | None = None) -> Estimate:
    """The truth in another world, its lengths multiplied by ``scale``."""
    move = np.eye(4) if move is None else move
    poses = np.stack([c.world_from_camera for c in truth.cameras])
    poses[:, :3, 3] *= scale
    frames = len(poses)
    return Estimate(
        cameras=tuple(PINHOLE.at(pose) for pose in move @ poses),
        held_out=np.zeros(frames, dtype=bool),
        index=np.arange(frames),
        times_s=0.1 * np.arange(frames),
        depth_m=scale * truth.depth_m,
        confidence=(truth.depth_m > 0).astype(np.float32),
        scale=Scale("poses", 0.0),
        focal_observed=True,
    )


def group(figures: GeometryFigures, name: str) -> DepthGroup:
    assert figures.depth is not None
    return next(g for g in figures.depth.groups if g.name == name)


def test_the_truth_itself_has_no_errors() -> None:
    figures = evaluate_geometry(found(known()), known())
    assert figures.path is not None
    assert figures.path.ate_m == pytest.approx(0, abs=1e-9)
    assert figures.scale is not None
    assert figures.scale.error_percent == pytest.approx(0, abs=1e-9)
    assert figures.pinhole is not None
    assert (figures.pinhole.focal_percent, figures.pinhole.principal_px) == (0, 0)
    whole = group(figures, "all")
    assert whole.true == FRAMES * 16 * 7, "what lies beyond 80 m does not count, the sky neither"
    assert whole.coverage == 1
    assert whole.as_is is not None
    assert whole.as_is.abs_rel == 0
    assert figures.notes == ()


@settings(max_examples=25)
@given(st.floats(0.2, 5), st.tuples(*[st.floats(-3, 3)] * 3), st.tuples(*[st.floats(-50, 50)] * 3))
def test_another_world_and_another_scale(
    scale: float, turn: tuple[float, float, float], shift: tuple[float, float, float]
) -> None:
    move = np.eye(4)
    move[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    move[:3, 3] = shift
    figures = evaluate_geometry(found(known(), scale, move), known())
    assert figures.path is not None
    assert figures.path.ate_m == pytest.approx(0, abs=1e-6)
    assert figures.path.translation_percent == pytest.approx(0, abs=1e-5)
    assert figures.scale is not None
    assert figures.scale.metres_per_unit == pytest.approx(1 / scale)
    assert figures.scale.error_percent == pytest.approx(100 * (scale - 1), abs=1e-6)
    assert figures.depth is not None
    assert figures.depth.median_scale == pytest.approx(1 / scale)
    for g in figures.depth.groups:
        assert g.as_is is not None
        assert g.path_scale is not None
        assert g.median_scale is not None
        assert g.as_is.abs_rel == pytest.approx(abs(scale - 1), abs=1e-6)
        assert g.path_scale.abs_rel == pytest.approx(0, abs=1e-6)
        assert g.median_scale.abs_rel == pytest.approx(0, abs=1e-6)


def test_moving_pixels_and_bands_are_told_apart() -> None:
    truth = known()
    estimate = found(truth)
    assert estimate.depth_m is not None
    assert truth.moving is not None
    depth_m = estimate.depth_m.copy()
    depth_m[truth.moving] *= 1.5
    depth_m[:, 9] = 0  # 4 m
    figures = evaluate_geometry(replace(estimate, depth_m=depth_m), truth)
    moving, static = group(figures, "moving"), group(figures, "static")
    assert moving.as_is is not None
    assert static.as_is is not None
    assert moving.as_is.abs_rel == pytest.approx(0.5)
    assert static.as_is.abs_rel == 0
    assert (moving.true, static.true) == (FRAMES * 16, FRAMES * 16 * 6)
    near, far, empty = (group(figures, n) for n in ("0-10 m", "40-80 m", "10-20 m"))
    assert near.coverage == pytest.approx(2 / 3)
    assert far.as_is is not None
    assert far.as_is.abs_rel == pytest.approx(0.25), "half of it moves"
    assert empty.coverage == 1


def test_a_band_holds_its_far_end() -> None:
    truth = known()
    edge = replace(truth, depth_m=np.where(truth.depth_m > 0, 10.0, 0.0), moving=None)
    figures = evaluate_geometry(found(edge), edge)
    assert group(figures, "0-10 m").true == group(figures, "all").true
    assert group(figures, "10-20 m").true == 0
    assert group(figures, "10-20 m").coverage is None
    assert group(figures, "10-20 m").as_is is None
    assert "does not say what moves" in figures.notes[0]


def test_the_order_of_frames_matters_to_the_path_alone() -> None:
    truth, order = known(), np.array([3, 0, 5, 1, 4, 2])
    estimate = found(truth, 1.2)
    assert estimate.depth_m is not None
    assert truth.moving is not None
    noise = np.random.default_rng(0).uniform(0.8, 1.2, truth.depth_m.shape)
    estimate = replace(estimate, depth_m=estimate.depth_m * noise, confidence=noise / 2)
    mixed = replace(
        estimate,
        cameras=tuple(estimate.cameras[i] for i in order),
        depth_m=estimate.depth_m[order],
        confidence=noise[order] / 2,
    )
    mixed_truth = GeometryTruth(
        tuple(truth.cameras[i] for i in order), truth.depth_m[order], truth.moving[order]
    )
    one, other = evaluate_geometry(estimate, truth), evaluate_geometry(mixed, mixed_truth)
    assert one.depth is not None
    assert other.depth is not None
    for a, b in zip(one.depth.groups, other.depth.groups, strict=True):
        assert a.as_is is not None
        assert b.as_is is not None
        assert b.as_is.abs_rel == pytest.approx(a.as_is.abs_rel)
    assert one.depth.trust is not None
    assert other.depth.trust is not None
    assert other.depth.trust.abs_rel == pytest.approx(one.depth.trust.abs_rel)
    assert one.path is not None
    assert other.path is not None
    assert other.path.ate_m == pytest.approx(one.path.ate_m, abs=1e-9)
    # A pairing that is wrong is another matter.
    wrong = evaluate_geometry(mixed, truth)
    assert wrong.path is not None
    assert wrong.path.ate_percent > 10


def test_held_out_frames_count_for_the_path_alone() -> None:
    truth = known()
    estimate = found(truth)
    assert estimate.depth_m is not None
    held_out = np.arange(FRAMES) == 2
    cameras = list(estimate.cameras)
    cameras[2] = cameras[2].at(cameras[2].world_from_camera + 0.5 * np.eye(4, k=3))
    without = replace(
        estimate,
        cameras=tuple(cameras),
        held_out=held_out,
        depth_m=estimate.depth_m * ~held_out[:, None, None],
    )
    figures = evaluate_geometry(without, truth)
    assert figures.path is not None
    assert figures.path.ate_m > 0.1
    assert group(figures, "all").coverage == 1
    assert figures.depth is not None
    assert figures.depth.frames == FRAMES - 1
    assert "Held-out frames (1)" in figures.notes[-1]


def test_a_standing_camera_has_no_path_and_no_scale() -> None:
    truth = known(np.tile(np.eye(4), (4, 1, 1)))
    figures = evaluate_geometry(found(truth, 2.0), truth)
    assert (figures.path, figures.scale, figures.path_m) == (None, None, 0)
    whole = group(figures, "all")
    assert whole.path_scale is None
    assert whole.as_is is not None
    assert whole.as_is.abs_rel == pytest.approx(1)
    assert whole.median_scale is not None
    assert whole.median_scale.abs_rel == pytest.approx(0)
    assert "true camera stands still" in figures.notes[0]


def test_a_scene_that_stands_in_a_drive_has_a_path_error_and_no_scale() -> None:
    truth = known()
    estimate = found(truth)
    standing = replace(estimate, cameras=(PINHOLE,) * FRAMES)
    figures = evaluate_geometry(standing, truth)
    assert figures.path is not None
    assert figures.path.ate_percent > 20
    assert figures.scale is None
    assert group(figures, "all").path_scale is None
    assert "shows no scale" in figures.notes[0]


def test_a_wrong_pinhole_is_measured_at_the_size_of_the_scene() -> None:
    truth = known()
    estimate = found(truth)
    off = replace(
        estimate,
        cameras=tuple(replace(c, fx_px=22.0, fy_px=22.0, cx_px=11.0, cy_px=9.0) for c in estimate.cameras),
        focal_observed=False,
    )
    pinhole = evaluate_geometry(off, truth).pinhole
    assert pinhole is not None
    assert pinhole.focal_percent == pytest.approx(10)
    assert pinhole.principal_px == pytest.approx(5)
    assert pinhole.observed is False
    figures = evaluate_geometry(off, replace(truth, calibrated=False))
    assert figures.pinhole is None
    assert "no calibration" in figures.notes[0]


def test_what_cannot_be_measured_is_none_and_said() -> None:
    truth = known()
    estimate = found(truth)
    bare = replace(estimate, depth_m=None, confidence=None, scale=None)
    assert evaluate_geometry(bare, truth).depth is None
    blind = evaluate_geometry(estimate, replace(truth, depth_m=np.zeros_like(truth.depth_m)))
    assert blind.depth is None
    assert "No frame with depth" in blind.notes[0]
    guess = evaluate_geometry(replace(estimate, scale=Scale("none: assumed", float("inf"))), truth)
    assert "Nothing fixed the scene's scale" in guess.notes[0]
    nothing = evaluate_geometry(replace(estimate, depth_m=np.zeros_like(truth.depth_m)), truth)
    assert nothing.depth is not None
    assert nothing.depth.median_scale is None
    assert nothing.depth.trust is None
    assert group(nothing, "all").coverage == 0
    assert group(nothing, "all").as_is is None
    two = known(bend(2))
    assert "two frames" in evaluate_geometry(found(two), two).notes[0]


def test_other_frames_are_refused() -> None:
    truth = known()
    with pytest.raises(InputError, match="the scene has 6 frames but the truth has 4"):
        evaluate_geometry(found(truth), known(bend(4)))
    wide = GeometryTruth(tuple(c.resized(32, 20) for c in truth.cameras), np.zeros((FRAMES, 20, 32)), None)
    with pytest.raises(InputError, match="are 16x10, those of the truth 32x20; expected the truth on"):
        evaluate_geometry(found(truth), wide)
