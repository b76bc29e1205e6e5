import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.geometry import GateOptions
from dreamdrive.geometry.cameras import mapping, sfm
from dreamdrive.geometry.cameras.mapping import MappingOutcome, reconstruct
from dreamdrive.geometry.cameras.sfm import SparseModel
from dreamdrive.geometry.evidence import observe
from dreamdrive.scene.clip import Clip
from tests.geometry.toy_drive import make_clip, path_error, straight


def run(clip: Clip, seed: int = 0) -> MappingOutcome:
    return reconstruct(clip, observe(clip), GateOptions(), seed)


@pytest.fixture(scope="module")
def clip() -> Clip:
    return make_clip(straight([0.5] * 7))


def test_a_drive_is_posed_and_the_same_seed_gives_the_same_poses(clip: Clip) -> None:
    first, second = run(clip), run(clip)
    assert first.settled is not None
    assert second.settled is not None
    assert path_error(first.settled.model.world_from_camera, straight([0.5] * 7)) < 0.002
    np.testing.assert_array_equal(
        first.settled.model.world_from_camera, second.settled.model.world_from_camera
    )
    np.testing.assert_array_equal(first.settled.model.points, second.settled.model.points)
    assert first.figures == second.figures


def test_a_folded_path_is_mapped_again_from_other_starts(clip: Clip, monkeypatch: pytest.MonkeyPatch) -> None:
    mapped, seeds = sfm.map_globally, list[int]()

    def map_badly_twice(database: Path, count: int, seed: int) -> SparseModel | None:
        seeds.append(seed)
        model = mapped(database, count, seed)
        assert model is not None
        folded = model.world_from_camera[[0, 5, 2, 7, 4, 1, 6, 3]]
        return replace(model, world_from_camera=folded) if len(seeds) < 3 else model

    monkeypatch.setattr(sfm, "map_globally", map_badly_twice)
    outcome = run(clip, seed=4)
    assert outcome.settled is not None
    assert seeds == [4, 5, 6]
    assert any("jumps" in note and "another start" in note for note in outcome.notes)
    assert path_error(outcome.settled.model.world_from_camera, straight([0.5] * 7)) < 0.002


def test_the_gate_refuses_shuffled_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mapping, "STARTS", 1)
    short = make_clip(straight([0.5] * 5))
    order = np.random.default_rng(1).permutation(len(short))
    outcome = run(replace(short, frames=short.frames[order]))
    assert outcome.settled is None
    assert any("jumps" in reason or "varies" in reason for reason in outcome.reasons)


@pytest.mark.slow
def test_a_start_from_standstill_is_accepted() -> None:
    steps = [0.0, 0.0, 0.0, 0.1, 0.2, 0.4, 0.6, 0.8]
    outcome = run(make_clip(straight(steps)))
    assert outcome.settled is not None
    found = np.linalg.norm(np.diff(outcome.settled.model.world_from_camera[:, :3, 3], axis=0), axis=1)
    assert found[:3].max() < 0.03 * found.max()


def test_blank_frames_are_refused_with_a_reason(clip: Clip) -> None:
    outcome = run(type(clip)(**{**vars(clip), "frames": np.full_like(clip.frames, 90)}))
    assert outcome.settled is None
    assert "too little" in outcome.reasons[0]


def test_two_frames_are_refused_with_a_reason(clip: Clip) -> None:
    outcome = run(make_clip(straight([0.5])))
    assert outcome.settled is None
    assert "too few" in outcome.reasons[0]


def test_a_request_to_terminate_stays_ours() -> None:
    """In a process of its own: pycolmap puts its handler in place when it is loaded."""
    code = """
import os, signal, sys
signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(7))
from dreamdrive.geometry.cameras.sfm import _colmap
_colmap()
os.kill(os.getpid(), signal.SIGTERM)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 7, done.stderr
    assert not done.stderr
