"""Whatever a file holds, a reader gives its noun or refuses with InputError: nothing else escapes."""

import json
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from dreamdrive.data.cameras.intrinsics import read_intrinsics
from dreamdrive.data.cameras.poses import read_pose_file
from dreamdrive.data.pictures.images import read_image
from dreamdrive.data.pictures.video import Video
from dreamdrive.errors import InputError

numbers = st.none() | st.booleans() | st.integers(-9, 9) | st.floats() | st.text(max_size=3)
values = st.recursive(
    numbers, lambda v: st.lists(v, max_size=4) | st.dictionaries(st.text(max_size=3), v, max_size=3)
)
careless = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=80)


@careless
@given(
    st.fixed_dictionaries(
        {},
        optional={
            "width": values,
            "height": st.just(48) | values,
            "intrinsics": values
            | st.fixed_dictionaries(dict.fromkeys(("fx", "fy", "cx", "cy"), st.just(20) | numbers)),
            "distortion": values
            | st.fixed_dictionaries({"model": st.just("opencv") | values, "coefficients": values}),
        },
    )
)
def test_calibration(tmp_path: Path, content):
    path = tmp_path / "c.json"
    path.write_text(json.dumps({"width": 64, "height": 48, **content}))
    with suppress(InputError):
        assert read_intrinsics(path, (64, 48)).camera.fx_px > 0


pose = st.lists(st.lists(st.floats(-2, 2) | numbers, min_size=4, max_size=4), min_size=4, max_size=4)


@careless
@given(
    st.fixed_dictionaries({"world_from_camera": values | st.lists(pose), "times_s": values})
    | st.fixed_dictionaries({"cameras": values | st.fixed_dictionaries({"a": values})})
    | st.fixed_dictionaries(
        {
            "cameras": st.fixed_dictionaries(
                {"a": st.fixed_dictionaries({"camera_to_world": values, "frames": values})}
            )
        }
    )
)
def test_poses_as_json(tmp_path: Path, content):
    path = tmp_path / "p.json"
    path.write_text(json.dumps(content))
    with suppress(InputError):
        assert len(read_pose_file(path, "--poses", "a")) > 0


identity = [[float(i == j) for j in range(4)] for i in range(4)]


@careless
@given(values)
def test_frames_of_a_camera(tmp_path: Path, frames):
    path = tmp_path / "p.json"
    path.write_text(json.dumps({"cameras": {"a": {"camera_to_world": [identity] * 3, "frames": frames}}}))
    with suppress(InputError):
        assert len(read_pose_file(path, "--poses", "a")) > 0


@careless
@given(st.lists(st.lists(st.floats() | st.integers(-3, 3), max_size=13), max_size=4) | st.text())
def test_poses_as_text(tmp_path: Path, content):
    path = tmp_path / "p.txt"
    text = content if isinstance(content, str) else "\n".join(" ".join(map(str, row)) for row in content)
    path.write_text(text, encoding="utf-8")
    with suppress(InputError):
        assert len(read_pose_file(path, "--poses", "a")) > 0


@careless
@given(
    st.binary(max_size=300),
    st.sampled_from([b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8", b"BM", b"II*\0", b"RIFF"]),
)
def test_pictures(tmp_path: Path, content, start):
    path = tmp_path / "0.png"
    path.write_bytes(start + content)
    with suppress(InputError):
        assert read_image(path).rgb.size > 0


@careless
@given(
    st.binary(max_size=300),
    st.sampled_from([b"", b"\0\0\0\x18ftypmp42", b"\x1aE\xdf\xa3", b"RIFF", b"GIF89a"]),
)
def test_videos(tmp_path: Path, content, start):
    path = tmp_path / "a.mp4"
    path.write_bytes(start + content)
    with suppress(InputError):
        assert list(Video.open(path).read(range(0, 2)))


@settings(parent=careless, max_examples=25)
@given(st.data())
def test_damaged_videos(make_video, tmp_path: Path, data):
    path = tmp_path / "clip.mp4"
    if not path.exists():
        make_video(8, size=(32, 16))
    whole = path.read_bytes()
    at = data.draw(st.integers(0, len(whole) - 1))
    spoilt = whole[:at] + data.draw(st.binary(min_size=1, max_size=40)) + whole[at:]
    damaged = tmp_path / "damaged.mp4"
    damaged.write_bytes(spoilt)
    with suppress(InputError):
        assert len(list(Video.open(damaged).read(range(0, 8)))) == 8


def test_a_folder_is_no_file(tmp_path):
    for read in (lambda: read_intrinsics(tmp_path, (64, 48)), lambda: read_pose_file(tmp_path, "--poses")):
        with pytest.raises(InputError, match="cannot be read"):
            read()
