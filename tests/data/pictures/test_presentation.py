"""What a video says of its pictures is done, or said."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from dreamdrive.data.clip_reader import read_clip
from dreamdrive.data.frames.select import UNBOUNDED
from dreamdrive.data.pictures.presentation import Presentation, check_flat
from dreamdrive.data.pictures.video import Video
from dreamdrive.errors import InputError
from tests.data.textures import approach, texture, write_video

ALL = range(0, UNBOUNDED)


def moments(count: int = 12, step_px: int = 6) -> list[np.ndarray]:
    """A grey picture that goes by sideways; codecs thin out colours."""
    wide = np.repeat(texture(96, 160 + count * step_px)[..., :1], 3, axis=2)
    return [np.ascontiguousarray(wide[:, k * step_px : k * step_px + 160]) for k in range(count)]


def interlaced(pictures: list[np.ndarray]) -> list[np.ndarray]:
    """Two moments a picture, the first on even lines."""
    woven = [first.copy() for first in pictures[::2]]
    for picture, second in zip(woven, pictures[1::2], strict=True):
        picture[1::2] = second[1::2]
    return woven


@pytest.mark.parametrize(
    ("aspect", "size"),
    [(Fraction(2), (320, 96)), (Fraction(1, 2), (160, 192)), (Fraction(4, 3), (213, 96))],
)
def test_pixels_that_are_not_square_are_made_square(tmp_path, aspect, size):
    pictures = list(approach(count=3))
    plain = next(Video.open(write_video(tmp_path / "a.mp4", pictures)).read(ALL))
    frame = next(Video.open(write_video(tmp_path / "b.mp4", pictures, aspect=aspect)).read(ALL))
    assert plain.size == (160, 96)
    assert plain.notes == ()
    assert frame.size == size
    assert f"160x96 are shown as {size[0]}x{size[1]}" in frame.notes[0]
    assert frame.rgb.mean() == pytest.approx(plain.rgb.mean(), abs=1)
    clip = read_clip(tmp_path / "b.mp4")
    assert clip.size[0] / clip.size[1] == pytest.approx(size[0] / size[1], rel=0.05)


def test_a_damaged_shape_of_pixels_is_left_alone(tmp_path):
    path = write_video(tmp_path / "a.mp4", list(approach(count=2)), aspect=Fraction(100))
    assert next(Video.open(path).read(ALL)).size == (160, 96)


@pytest.mark.parametrize("flags", [{"flags": "+ildct+ilme", "x264-params": "tff=1"}, {}])
def test_interlaced_pictures_become_one_moment_each(tmp_path, flags):
    pictures = moments()
    frames = list(Video.open(write_video(tmp_path / "a.mp4", interlaced(pictures), **flags)).read(ALL))
    assert [frame.index for frame in frames] == list(range(6))
    np.testing.assert_allclose([frame.time_s for frame in frames], np.arange(6) / 20, atol=1e-6)
    assert "interlaced" in frames[0].notes[0]
    for frame, first, second in zip(frames, pictures[::2], pictures[1::2], strict=True):
        # Which of the two is the encoder's choice.
        misses = sorted(np.abs(frame.rgb[8:-8].astype(int) - each[8:-8]).mean() for each in (first, second))
        assert misses[0] < 0.4 * misses[1]


@pytest.mark.parametrize("flags", [{"flags": "+ildct+ilme", "x264-params": "tff=1"}, {}])
def test_pictures_of_one_moment_stay_as_they_are_whatever_they_say(tmp_path, flags):
    pictures = moments()
    frames = list(Video.open(write_video(tmp_path / "a.mp4", pictures, crf="4", **flags)).read(ALL))
    assert frames[0].notes == ()
    for frame, picture in zip(frames, pictures, strict=True):
        assert np.abs(frame.rgb.astype(int) - picture).mean() < 4


def test_frames_that_are_asked_for_are_the_same_ones_when_interlaced(tmp_path):
    path = write_video(tmp_path / "a.mp4", interlaced(moments()))
    every = list(Video.open(path).read(ALL))
    some = list(Video.open(path).read(range(1, 6, 2)))
    assert [frame.index for frame in some] == [1, 3, 5]
    for frame in some:
        np.testing.assert_array_equal(frame.rgb, every[frame.index].rgb)


@pytest.mark.parametrize("across", [1, -1])
@pytest.mark.parametrize("down", [1, -1])
@pytest.mark.parametrize("swapped", [False, True])
def test_pictures_are_turned_and_mirrored_as_the_matrix_says(across, down, swapped):
    """Where pixel (x, y) goes, by the matrix itself."""
    picture = texture(6, 9)
    axes = ((0, across), (down, 0)) if swapped else ((across, 0), (0, down))
    shown = Presentation(axes=axes).apply(picture)
    places = np.array([(x, y) for y in range(6) for x in range(9)]) @ np.array(axes).T
    places -= places.min(axis=0)
    assert shown.shape[:2] == ((9, 6) if swapped else (6, 9))
    np.testing.assert_array_equal(shown[places[:, 1], places[:, 0]], picture.reshape(-1, 3))
    assert Presentation(axes=axes).size(9, 6) == shown.shape[1::-1]


def test_a_mirroring_header_is_followed(make_video):
    path = make_video(3)
    plain = next(Video.open(path).read(ALL)).rgb
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 4 + 40
    data[at : at + 4] = (-65536).to_bytes(4, "big", signed=True)
    path.write_bytes(data)
    np.testing.assert_array_equal(next(Video.open(path).read(ALL)).rgb, plain[:, ::-1])


def test_an_oblique_matrix_is_left_alone(make_video):
    path = make_video(3)
    plain = next(Video.open(path).read(ALL)).rgb
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 4 + 40
    for place, value in zip((0, 4, 12, 16), (46341, 46341, -46341, 46341), strict=True):
        data[at + place : at + place + 4] = value.to_bytes(4, "big", signed=True)
    path.write_bytes(data)
    np.testing.assert_array_equal(next(Video.open(path).read(ALL)).rgb, plain)


def test_a_sphere_by_its_header_is_refused():
    check_flat(["DISPLAYMATRIX"], "a.mp4")
    with pytest.raises(InputError, match=r"a\.mp4 holds a 360 degree picture.*v360"):
        check_flat(["DISPLAYMATRIX", "SPHERICAL"], "a.mp4")


def test_a_panorama_by_its_shape_is_spoken_of(tmp_path):
    pictures = [np.ascontiguousarray(each[:80]) for each in moments(3)]
    notes = read_clip(write_video(tmp_path / "a.mp4", pictures)).provenance["notes"]
    assert "twice as wide as high" in notes[0]


def test_the_frames_of_a_moving_picture_differ():
    assert all((first != second).any() for first, second in pairwise(moments()))
