"""Features from files."""

import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from safetensors.numpy import save_file

from dreamdrive.data import feature_file, read_clip
from dreamdrive.data.feature_file import FeatureFile, read_features, write_features
from dreamdrive.errors import InputError
from dreamdrive.prior.replay import REPLAY
from dreamdrive.scene.control import Control
from tests.data.textures import texture

ABOUT = {"model": "a stand-in", "steps": 3}


def features(frames: int = 6, height: int = 4, width: int = 8, channels: int = 2) -> np.ndarray:
    return np.random.default_rng(0).normal(size=(frames, height, width, channels)).astype(np.float32)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "pictures").mkdir()
    for index in range(6):
        cv2.imwrite(str(tmp_path / f"pictures/{index}.png"), texture(32, 64, index))
    return tmp_path / "pictures"


def written(path: Path, **arrays: np.ndarray) -> Path:
    write_features(path, FeatureFile(arrays, ABOUT))
    return path


@settings(
    max_examples=30,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    st.dictionaries(st.text(min_size=1, max_size=8).filter(lambda n: n != "__metadata__"), st.tuples(
        *[st.integers(1, 5)] * 3, st.sampled_from(["<f2", "<f4"])), min_size=1, max_size=3),
    st.dictionaries(st.text(max_size=5), st.none() | st.integers(-(2**63), 2**63 - 1)
        | st.text(max_size=5), max_size=3),
)  # fmt: skip
def test_what_is_written_is_read(tmp_path, shapes, provenance):
    arrays = {
        name: np.random.default_rng(k).normal(size=(3, *shape[:3])).astype(shape[3])
        for k, (name, shape) in enumerate(shapes.items())
    }
    write_features(tmp_path / "f.safetensors", FeatureFile(arrays, provenance))
    read = read_features(tmp_path / "f.safetensors")
    assert read.provenance == provenance
    assert read.arrays.keys() == arrays.keys()
    for name, array in arrays.items():
        assert read.arrays[name].dtype == array.dtype
        np.testing.assert_array_equal(read.arrays[name], array)


@settings(
    max_examples=60,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.binary(max_size=60), st.integers(0, 400), st.booleans())
def test_rubbish_is_refused_by_name(tmp_path, rubbish, at, cut):
    """A file with bytes of its own, or a good one that is cut or overwritten somewhere."""
    good = written(tmp_path / "good.safetensors", one=features(2, 2, 2, 1)).read_bytes()
    broken = rubbish if at == 0 else good[:at] if cut else good[:at] + rubbish + good[at + len(rubbish) :]
    path = tmp_path / "rubbish.safetensors"
    path.write_bytes(broken)
    try:
        read = read_features(path)
    except InputError as error:
        assert str(path) in str(error)  # noqa: PT017
    else:  # numbers or words changed, not their form
        assert read.arrays


@pytest.mark.parametrize(
    ("arrays", "metadata", "problem"),
    [
        ({}, {"provenance": "{}"}, "holds no array"),
        (
            {"a": features().astype(np.float64)},
            {"provenance": "{}"},
            "'a' holds F64; expected float16 or float32",
        ),
        ({"a": features()[0]}, {"provenance": "{}"}, r"'a' has the shape \(4, 8, 2\)"),
        ({"a": features(channels=640)}, {"provenance": "{}"}, "640 channels; expected at most 128"),
        ({"a": features() * np.float32("nan")}, {"provenance": "{}"}, "NaN or infinite"),
        ({"a": features(), "b": features(3)}, {"provenance": "{}"}, "numbers of frames: 'a' 6, 'b' 3"),
        ({"a": features()}, None, "does not say where it comes from"),
        ({"a": features()}, {"provenance": "[1]"}, "no JSON object"),
        ({"a": features()}, {"provenance": "model"}, "'provenance' is not JSON"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, arrays, metadata, problem):
    save_file(arrays, tmp_path / "f.safetensors", metadata=metadata)
    with pytest.raises(InputError, match=problem):
        read_features(tmp_path / "f.safetensors")


def test_rows_are_those_of_the_frames_that_the_file_names(tmp_path):
    """Features of frames 4 to 9 are no features of frames 0 to 5, though both are six."""
    made = FeatureFile({"a": features(6)}, {"frame_index": [4, 5, 6, 7, 8, 9]})
    path = tmp_path / "f.safetensors"
    for wanted, rows in (([4, 5, 6, 7, 8, 9], [0, 1, 2, 3, 4, 5]), ([5, 7], [1, 3])):
        got = made.of_frames(np.array(wanted), lambda: 20, path)
        np.testing.assert_array_equal(got.arrays["a"], made.arrays["a"][rows])
    for wanted in ([0, 1, 2, 3, 4, 5], [9, 10]):
        with pytest.raises(InputError, match=r"is of 6 frames of its clip, from 4 to 9; frame (0|10) is"):
            made.of_frames(np.array(wanted), lambda: 20, path)
    for index in ([4, 5], "0:6", [0, 1, 2, 3, 4, None]):
        with pytest.raises(InputError, match="frame_index is no list of 6 frames"):
            FeatureFile(made.arrays, {"frame_index": index}).of_frames(np.arange(6), lambda: 20, path)


def test_a_missing_file_and_unusable_arrays(tmp_path):
    with pytest.raises(InputError, match=r"none.safetensors cannot be read"):
        read_features(tmp_path / "none.safetensors")
    with pytest.raises(ValueError, match="'a' holds float64; expected float16 or float32"):
        written(tmp_path / "f.safetensors", a=features().astype(np.float64))


def test_a_clip_has_the_features_of_its_frames(folder, tmp_path):
    whole, chosen = features(), features(3)
    of_all = written(tmp_path / "all.safetensors", deep=whole)
    of_chosen = written(tmp_path / "chosen.safetensors", deep=chosen)
    clip = read_clip(folder, frames="0:6:2", features=of_all)
    np.testing.assert_array_equal(clip.features["deep"], whole[[0, 2, 4]])
    assert clip.provenance["features"] == ABOUT
    np.testing.assert_array_equal(
        read_clip(folder, frames="1:6:2", features=of_chosen).features["deep"], chosen
    )
    with pytest.raises(InputError, match="has 3 frames, but the input has 6, 2 of them selected"):
        read_clip(folder, frames="0:2", features=of_chosen)


def test_replay_hands_them_on_beside_the_appearance(folder, tmp_path):
    clip = REPLAY(Control(folder, features=written(tmp_path / "f.safetensors", deep=features())))
    assert set(clip.features) == {"appearance", "deep"}
    own = written(tmp_path / "own.safetensors", appearance=features())
    np.testing.assert_array_equal(REPLAY(Control(folder, features=own)).features["appearance"], features())


def test_what_is_cut_away_of_the_pictures_is_cut_away_of_the_features(tmp_path):
    """A ramp of columns stays the ramp of the columns that are left."""
    (tmp_path / "wide").mkdir()
    for index in range(2):
        cv2.imwrite(str(tmp_path / f"wide/{index}.png"), texture(100, 204, index))
    columns = np.tile((np.arange(51, dtype=np.float32) + 0.5)[None, None, :, None] * 4, (2, 25, 1, 1))
    path = written(tmp_path / "f.safetensors", column=columns)
    clip = read_clip(tmp_path / "wide", size=(200, 100), features=path)
    expected = 2 + (np.arange(51) + 0.5) / 51 * 200
    np.testing.assert_allclose(clip.features["column"][0, 3, :, 0], expected, atol=1e-3)


def test_features_of_distorted_pictures_are_refused(folder, tmp_path):
    intrinsics = {"width": 64, "height": 32, "intrinsics": {"fx": 40, "fy": 40, "cx": 31.5, "cy": 15.5}}
    bent = intrinsics | {"distortion": {"model": "opencv", "coefficients": [-0.1, 0, 0, 0]}}
    (tmp_path / "lens.json").write_text(json.dumps(bent))
    path = written(tmp_path / "f.safetensors", deep=features())
    with pytest.raises(InputError, match="undistort the input first"):
        read_clip(folder, intrinsics=tmp_path / "lens.json", features=path)


def test_a_file_is_judged_by_its_header(tmp_path, monkeypatch):
    path = tmp_path / "f.safetensors"
    expected = (
        "expected a .safetensors file with arrays (frames, rows, columns, channels), see docs/replay.md"
    )

    def refusal() -> str:
        with pytest.raises(InputError) as caught:
            read_features(path)
        return str(caught.value).replace(str(path), "FILE")

    path.write_bytes((2**40).to_bytes(8, "little") + b"{}")
    assert refusal() == (
        f"--features FILE cannot be read (it states a header of 1099511627776 bytes and has 10); {expected}"
    )
    path.unlink()
    os.mkfifo(path)
    assert refusal() == (
        f"--features FILE cannot be read (the file cannot be read: it is not a regular file); {expected}"
    )
    path.unlink()
    written(path, a=features())
    monkeypatch.setattr(feature_file, "FEATURE_BYTES", 1000)
    assert refusal().startswith("--features FILE cannot be read (it holds 0 MB, more than 0)")
