"""Videos from photos by a real pipeline of diffusers with tiny random networks."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.prior import choose_prior
from dreamdrive.prior.diffusers_i2v import find_kind
from dreamdrive.scene.control import Control
from tests.data.textures import texture
from tests.prior.tiny_pipelines import write_ltx

pytest.importorskip("diffusers")
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")

SIZE = (64, 32)


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_ltx(tmp_path_factory.mktemp("ltx"))


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    cv2.imwrite(str(tmp_path / "photo.png"), texture(32, 64, 0))
    return tmp_path / "photo.png"


def named(folder: Path, name: object) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "model_index.json").write_text(json.dumps({"_class_name": name}))
    return folder


def test_a_photo_becomes_a_clip(photo, weights, tmp_path):
    (tmp_path / "k.json").write_text(
        json.dumps({"width": 64, "height": 32, "intrinsics": {"fx": 50, "fy": 50, "cx": 31.5, "cy": 15.5}})
    )
    prior = choose_prior("diffusers")
    asked = Control(
        photo, weights=weights, size=SIZE, steps=2, frames="0:9", fps=5.0, intrinsics=tmp_path / "k.json"
    )
    told: list[tuple[int, int]] = []
    clip = prior(asked, lambda *step: told.append(step))
    assert clip.frames.shape == (9, 32, 64, 3)
    assert told == [(1, 2), (2, 2)]
    np.testing.assert_allclose(clip.times_s, np.arange(9) / 5)
    assert clip.known.intrinsics
    assert clip.rig[0].fx_px == 50
    assert clip.requested is None
    assert "LTXImageToVideoPipeline" in clip.provenance["notes"][-1]
    np.testing.assert_array_equal(prior(asked).frames, clip.frames)
    shown = prior(Control(photo, weights=weights, size=SIZE, steps=2, frames="0:9", prompt="a car"))
    assert shown.times_s[1] == pytest.approx(1 / 25)
    assert (shown.frames != clip.frames).any()


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("WanPipeline", "a WanPipeline, which does not make videos from photos: it takes no image"),
        ("StableDiffusionPipeline", "takes no image and no num_frames"),
        ("UNet2DConditionModel", r"holds a UNet2DConditionModel, which diffusers .* does not have"),
        ("SoraPipeline", r"holds a SoraPipeline, which diffusers .* does not have"),
        (["custom", "Pipeline"], r"names no class of diffusers, but \['custom', 'Pipeline'\]"),
        (None, "names no class of diffusers"),
    ],
)
def test_other_pipelines_are_refused_by_name(tmp_path, name, problem):
    with pytest.raises(InputError, match=problem):
        find_kind(named(tmp_path / "other", name))


@pytest.mark.parametrize(
    "name",
    [
        "StableVideoDiffusionPipeline",
        "CogVideoXImageToVideoPipeline",
        "LTXImageToVideoPipeline",
        "HunyuanVideoImageToVideoPipeline",
        "WanImageToVideoPipeline",
    ],
)
def test_those_from_photo_to_video_are_taken(tmp_path, name, monkeypatch):
    monkeypatch.setattr("dreamdrive.prior.diffusers_i2v.find_spec", lambda name: name)
    assert find_kind(named(tmp_path / "one", name)).name == name


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("dreamdrive.prior.diffusers_i2v.find_spec", lambda name: None)
    with pytest.raises(InputError, match="WanImageToVideoPipeline needs the package ftfy"):
        find_kind(named(tmp_path / "wan", "WanImageToVideoPipeline"))


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"frames": "0:9", "hold_out": 99}, "withholds nothing of 9 frames"),
        ({"frames": "0:1"}, "selects a single frame"),
        ({"frames": "0:0"}, "selects no frame"),
        ({"frames": "200:"}, "has 161 frames"),
        ({"frames": "0:x"}, "expected START:STOP"),
    ],
)
def test_frames_are_checked_before_anything_is_loaded(photo, weights, monkeypatch, options, problem):
    monkeypatch.setattr("dreamdrive.prior.diffusers_pipeline.load", lambda *_: pytest.fail("loaded"))
    with pytest.raises(InputError, match=problem):
        choose_prior("diffusers")(Control(photo, weights=weights, size=SIZE, **options))


def test_an_end_counted_from_the_end_is_that_of_the_usual_number(photo, weights, monkeypatch):
    def made(pipeline, steps, progress, num_frames, **more):
        assert num_frames == 161
        return type("Made", (), {"frames": np.zeros((1, num_frames, 32, 64, 3), np.float32)})

    monkeypatch.setattr("dreamdrive.prior.diffusers_pipeline.run", made)
    clip = choose_prior("diffusers")(Control(photo, weights=weights, size=SIZE, frames="-9:-1:2"))
    assert clip.source_index.tolist() == [152, 154, 156, 158]


def test_a_model_that_makes_fewer_frames_is_said_to(photo, weights, monkeypatch):
    made = type("Made", (), {"frames": np.zeros((1, 9, 32, 64, 3), np.float32)})
    monkeypatch.setattr("dreamdrive.prior.diffusers_pipeline.run", lambda *_, **__: made)
    clip = choose_prior("diffusers")(Control(photo, weights=weights, size=SIZE, frames="0:12"))
    assert len(clip) == 9
    assert clip.provenance["notes"][-1].startswith("The model made 9 frames instead of 12")


def test_svd_says_its_number_of_frames_before_it_is_loaded(photo, tmp_path, monkeypatch):
    monkeypatch.setattr("dreamdrive.prior.diffusers_pipeline.load", lambda *_: pytest.fail("loaded"))
    svd = named(tmp_path / "svd", "StableVideoDiffusionPipeline")
    prior = choose_prior("diffusers")
    with pytest.raises(InputError, match="has no number of frames of its own: give --frames 0:STOP"):
        prior(Control(photo, weights=svd, size=SIZE))
    (svd / "unet").mkdir()
    (svd / "unet" / "config.json").write_text('{"num_frames": 14}')
    with pytest.raises(InputError, match="has 14 frames"):
        prior(Control(photo, weights=svd, size=SIZE, frames="14:"))


def test_what_it_cannot_do_is_refused(photo, weights, tmp_path):
    prior = choose_prior("diffusers")
    cog = named(tmp_path / "cog", "CogVideoXImageToVideoPipeline")
    with pytest.raises(InputError, match="does not say how many frames a second it makes: give --fps"):
        prior(Control(photo, weights=cog))
    with pytest.raises(InputError, match="has no size of its own: give --size"):
        prior(Control(photo, weights=cog, fps=8))
    with pytest.raises(
        InputError, match=r"cannot be loaded as CogVideoXImageToVideoPipeline: .* expected all"
    ):
        prior(Control(photo, weights=cog, fps=8, size=SIZE))
    svd = named(tmp_path / "svd", "StableVideoDiffusionPipeline")
    with pytest.raises(InputError, match="StableVideoDiffusionPipeline takes no --prompt"):
        prior(Control(photo, weights=svd, prompt="a street"))
    with pytest.raises(InputError, match=r"--fps 7.5: StableVideoDiffusionPipeline takes whole frames"):
        prior(Control(photo, weights=svd, fps=7.5))
    with pytest.raises(InputError, match="video models make multiples of 16 pixels"):
        prior(Control(photo, weights=weights, size=(60, 40)))
    with pytest.raises(InputError, match=r"LTXImageToVideoPipeline refuses .* divisible by 32"):
        prior(Control(photo, weights=weights, size=(48, 16), steps=1, frames="0:9"))
    with pytest.raises(InputError, match="takes no --trajectory"):
        prior(Control(photo, weights=weights, trajectory=photo))
    with pytest.raises(InputError, match="--steps 0: expected 1 or more"):
        prior(Control(photo, weights=weights, steps=0))
    with pytest.raises(InputError, match="expected the folder of a diffusers pipeline"):
        prior(Control(photo, weights=tmp_path))
