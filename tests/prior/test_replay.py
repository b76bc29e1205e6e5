import dataclasses
import inspect
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.data import read_clip, write_trajectory
from dreamdrive.errors import InputError
from dreamdrive.prior import PRIORS, choose_prior
from dreamdrive.prior.replay import REPLAY, replay
from dreamdrive.scene.control import Command, Control
from tests.data.textures import texture
from tests.prior.paths import circle


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for index in range(6):
        cv2.imwrite(str(tmp_path / f"{index}.png"), texture(48, 64, index))
    return tmp_path


def test_replay_is_the_recording_with_features(folder):
    clip = REPLAY(Control(folder, frames="0:6:2", fps=4.0, size=(32, 24), hold_out=2, hfov_deg=80.0))
    read = read_clip(folder, frames="0:6:2", fps=4.0, size=(32, 24), hold_out=2, hfov_deg=80.0)
    np.testing.assert_array_equal(clip.frames, read.frames)
    np.testing.assert_array_equal(clip.times_s, read.times_s)
    assert clip.rig[0].matrix.tolist() == read.rig[0].matrix.tolist()
    assert clip.features["appearance"].shape == (3, 12, 16, 15)


def test_every_control_reaches_the_reader():
    """What it says it takes must be handed on: both have the same names."""
    of_others = {"dataset", "scene", "cameras"}
    assert choose_prior("replay").takes == of_others | set(inspect.signature(read_clip).parameters)


def test_replay_needs_an_input():
    with pytest.raises(InputError, match="needs an input"):
        REPLAY(Control())


def test_priors_are_found_by_name():
    assert choose_prior("replay").make is replay
    assert all(prior.takes <= set(Control.__dataclass_fields__) for prior in PRIORS.values())
    with pytest.raises(InputError, match="--prior sora: unknown; available are replay, street-world"):
        choose_prior("sora")


def test_the_path_that_a_recording_was_asked_for_is_kept(folder, tmp_path):
    write_trajectory(circle(5.0, 0.02, seconds=0.5), tmp_path / "asked.json")
    clip = REPLAY(Control(folder, frames="1:6:2", fps=10.0, trajectory=tmp_path / "asked.json"))
    assert clip.requested is not None
    assert clip.known.world_from_camera is None
    np.testing.assert_allclose(clip.requested.times_s, [0, 0.2, 0.4])
    np.testing.assert_allclose(
        clip.requested.world_from_camera, circle(5.0, 0.02).world_from_camera[[0, 2, 4]], atol=1e-9
    )
    write_trajectory(circle(5.0, seconds=9.0, rate_hz=1), tmp_path / "other.json")
    with pytest.raises(InputError, match=r"--trajectory .* do not meet the 3 selected frames"):
        REPLAY(Control(folder, frames="1:6:2", fps=10.0, trajectory=tmp_path / "other.json"))


def test_contradictions_are_refused():
    prior = dataclasses.replace(choose_prior("replay"), takes=frozenset({"trajectory", "action", "steps"}))
    with pytest.raises(InputError, match="--trajectory and --action both tell where to drive"):
        prior.check(Control(trajectory=Path("a.json"), action=Command("left")))
    with pytest.raises(InputError, match="--steps 0: expected 1 or more"):
        prior.check(Control(steps=0))
