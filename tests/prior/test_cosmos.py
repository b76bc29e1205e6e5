"""Cosmos 3 through the real pipeline of diffusers, with tiny random networks."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.data import write_trajectory
from dreamdrive.errors import InputError
from dreamdrive.prior import choose_prior, cosmos
from dreamdrive.prior.cosmos import relative_poses
from dreamdrive.scene.control import Command, Control
from tests.data.textures import texture
from tests.prior.paths import circle
from tests.prior.tiny_pipelines import write_cosmos

pytest.importorskip("diffusers")
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")

SIZE = (320, 192)


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_cosmos(tmp_path_factory.mktemp("cosmos"))


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    cv2.imwrite(str(tmp_path / "photo.png"), texture(192, 320, 0))
    return tmp_path / "photo.png"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_trajectory(circle(8.0, 0.02, seconds=6.0), tmp_path / "path.json")
    return tmp_path / "path.json"


def control(photo: Path, path: Path, weights: Path, **more: object) -> Control:
    given = {"frames": "0:5", "size": SIZE, "steps": 2, **more}
    return Control(photo, trajectory=path, weights=weights, **given)


def test_a_photo_and_a_path_become_a_clip(photo, path, weights):
    told: list[tuple[int, int]] = []
    prior = choose_prior("cosmos")
    clip = prior(control(photo, path, weights, hold_out=2), lambda *step: told.append(step))
    assert clip.frames.shape == (5, 192, 320, 3)
    assert told == [(1, 2), (2, 2)]
    np.testing.assert_allclose(clip.times_s, np.arange(5) / 10)
    assert clip.requested is not None
    np.testing.assert_allclose(
        clip.requested.world_from_camera, circle(8.0, 0.02).world_from_camera[:5], atol=1e-9
    )
    assert clip.known.world_from_camera is None
    assert not clip.known.intrinsics
    assert clip.held_out.sum() == 2
    assert set(clip.features) == {"appearance"}
    assert any("guardrail" in note for note in clip.provenance["notes"])
    again = prior(control(photo, path, weights))
    np.testing.assert_array_equal(again.frames, clip.frames)
    assert (prior(control(photo, path, weights, seed=1, steps=1)).frames != clip.frames).any()


def test_what_the_pipeline_is_told(photo, path, weights, monkeypatch):
    """The settings of the public examples reach the real class, and the real condition takes them."""
    seen: dict[str, object] = {}

    def note(pipeline, steps, progress, **arguments):
        seen.update(arguments, shift=pipeline.scheduler.config.flow_shift, checker=pipeline.safety_checker)
        return type("Made", (), {"video": np.zeros((61, 192, 320, 3), np.float32)})

    monkeypatch.setattr("dreamdrive.prior.diffusers_pipeline.run", note)
    choose_prior("cosmos")(control(photo, path, weights, frames=None, prompt="a street"))
    told = seen["action"]
    np.testing.assert_allclose(
        told.raw_actions.numpy(), relative_poses(circle(8.0, 0.02, seconds=6.0), 60, 10.0), atol=1e-6
    )
    assert (told.mode, told.domain_name, told.resolution_tier) == ("forward_dynamics", "av", 256)
    assert (told.chunk_size, told.view_point, told.image.size) == (60, "ego_view", SIZE)
    assert (seen["fps"], seen["guidance_scale"], seen["shift"], seen["prompt"]) == (
        10.0,
        1.0,
        10.0,
        "a street",
    )
    assert seen["use_system_prompt"] is False
    assert seen["enable_safety_check"] is False
    assert seen["checker"] is None


def test_the_sizes_are_those_of_the_pipeline():
    module = pytest.importorskip("diffusers.pipelines.cosmos.pipeline_cosmos3_omni")
    bins = module._ACTION_RESOLUTION_BINS
    for (width, height), tier in cosmos.TIERS.items():
        assert (height, width) in bins[str(tier)].values()


def test_selected_frames_start_at_the_identity(photo, path, weights, monkeypatch):
    made = type("Made", (), {"video": np.zeros((5, 192, 320, 3), np.float32)})
    monkeypatch.setattr("dreamdrive.prior.diffusers_pipeline.run", lambda *_, **__: made)
    clip = choose_prior("cosmos")(control(photo, path, weights, frames="1:5:2"))
    assert clip.requested is not None
    np.testing.assert_allclose(clip.requested.world_from_camera[0], np.eye(4), atol=1e-12)
    np.testing.assert_allclose(clip.requested.positions_m[1, 2], 1.6, atol=1e-3)
    assert clip.source_index.tolist() == [1, 3]


def test_what_cannot_be_made_is_refused(photo, path, weights, tmp_path):
    prior = choose_prior("cosmos")
    with pytest.raises(InputError, match="needs --trajectory FILE: a path of at least 6 s"):
        prior(Control(photo, weights=weights))
    with pytest.raises(InputError, match="takes no --action"):
        prior(Control(photo, weights=weights, action=Command("left")))
    with pytest.raises(InputError, match="--size 480x270: Cosmos 3 makes 320x192"):
        prior(control(photo, path, weights, size=(480, 270)))
    with pytest.raises(InputError, match=r"makes 4n \+ 1 frames, at most 61"):
        prior(control(photo, path, weights, frames="0:6"))
    with pytest.raises(InputError, match="needs an input: a photo"):
        prior(control(None, path, weights))
    with pytest.raises(InputError, match="withholds nothing of 5 frames"):
        prior(control(photo, path, tmp_path, frames="0:5", hold_out=50))
    (tmp_path / "model_index.json").write_text(json.dumps({"_class_name": "WanPipeline"}))
    with pytest.raises(InputError, match="holds a WanPipeline; --prior cosmos takes a Cosmos3OmniPipeline"):
        prior(control(photo, path, tmp_path))
    write_trajectory(circle(8.0, seconds=2.0), tmp_path / "short.json")
    with pytest.raises(InputError, match="lasts 2 s; expected at least 6 s"):
        prior(control(photo, tmp_path / "short.json", weights, frames=None))


def test_a_cosmos_without_actions_is_refused(photo, path, tmp_path):
    with pytest.raises(InputError, match="was not trained to follow a path"):
        choose_prior("cosmos")(control(photo, path, write_cosmos(tmp_path / "other", follows=False)))
