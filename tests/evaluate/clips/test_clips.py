"""What counts as a clip, and which belong together."""

from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.evaluate.clips import clips
from dreamdrive.evaluate.clips.clips import open_clips, pairs_of, read_frames
from tests.evaluate.sets import write_clip, write_set


def write_video(path: Path, frames: int) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=Fraction(10))
        stream.width, stream.height = 48, 40
        for i in range(frames):
            picture = np.full((40, 48, 3), 20 * i, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def test_folders_and_videos_are_clips_in_natural_order(tmp_path: Path) -> None:
    write_clip(tmp_path / "clip10", 0)
    write_clip(tmp_path / "clip2", 1)
    write_video(tmp_path / "clip3.mp4", 5)
    (tmp_path / "notes").mkdir()
    (tmp_path / ".hidden").mkdir()
    found = open_clips(tmp_path)
    assert list(found) == ["clip2", "clip3", "clip10"]
    assert [len(read_frames(source)) for source in found.values()] == [4, 5, 4]


def test_one_clip_is_a_set_of_one(tmp_path: Path) -> None:
    write_clip(tmp_path / "a", 0)
    write_video(tmp_path / "b.mp4", 5)
    assert list(open_clips(tmp_path / "a")) == ["a"]
    assert list(open_clips(tmp_path / "b.mp4")) == ["b"]


def test_frames_are_those_of_the_files(tmp_path: Path) -> None:
    write_clip(tmp_path / "a", 0)
    frames = read_frames(open_clips(tmp_path / "a")["a"])
    assert (frames[2] == cv2.imread(str(tmp_path / "a" / "2.png"))[..., ::-1]).all()


def test_equal_names_pair(tmp_path: Path) -> None:
    first, second = open_clips(write_set(tmp_path / "x")), open_clips(write_set(tmp_path / "y"))
    assert pairs_of(first, second) == [("a", "a"), ("b", "b"), ("c", "c")]
    del second["b"]
    assert pairs_of(first, second) == "the names of the clips differ: b is in the real set only"
    assert pairs_of({"a": first["a"]}, {"c": first["c"]}) == [("a", "c")]


def test_what_is_no_set(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        open_clips(tmp_path / "none")
    (tmp_path / "empty" / "deep").mkdir(parents=True)
    with pytest.raises(InputError, match="holds no clip"):
        open_clips(tmp_path / "empty")
    write_clip(tmp_path / "twice" / "a", 0)
    write_video(tmp_path / "twice" / "a.mp4", 2)
    with pytest.raises(InputError, match="two clips named a"):
        open_clips(tmp_path / "twice")


def test_frames_that_do_not_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_clip(tmp_path / "a", 0)
    source = open_clips(tmp_path / "a")["a"]
    monkeypatch.setattr(clips, "MAX_BYTES", 3 * 48 * 40 * 3)
    with pytest.raises(InputError, match="more than 3 frames do not fit"):
        read_frames(source)
    cv2.imwrite(str(tmp_path / "a" / "1.png"), np.zeros((40, 50, 3), np.uint8))
    with pytest.raises(InputError, match=r"1\.png is 50x40, not 48x40"):
        read_frames(source)
