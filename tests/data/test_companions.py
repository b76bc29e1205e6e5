"""Which images of a folder are its frames."""

import time
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from dreamdrive.data.companions import frames_among
from dreamdrive.errors import InputError


def kept(*names: str) -> list[str]:
    return [file.name for file in frames_among([Path("folder") / name for name in names]).files]


@pytest.mark.parametrize(
    "beside",
    [
        "0001_mask.png",
        "0001.mask.png",
        "0001-Depth.tif",
        "mask_0001.png",
        "0001_sky_mask.png",
        "0001mask.png",
    ],
)
def test_what_a_name_says_to_be_beside_a_frame_is_left_out(beside: str) -> None:
    assert kept("0000.jpg", "0001.jpg", beside) == ["0000.jpg", "0001.jpg"]


def test_the_same_picture_in_several_kinds_is_read_once_and_without_loss() -> None:
    listed = frames_among([Path("0.jpg"), Path("0.png"), Path("1.JPG"), Path("1.png")])
    assert [file.name for file in listed.files] == ["0.png", "1.png"]
    assert listed.notes == (
        "2 images beside the frames are the same ones in another kind of file and left out, such as 0.jpg, "
        "1.JPG.",
    )


def test_a_word_alone_leaves_nothing_out() -> None:
    """A folder of masks, or of a clip called sky, is what was asked for."""
    names = ["mask_0.png", "mask_1.png"]
    assert kept(*names) == names
    assert kept("sky_drive_0.png", "sky_drive_1.png") == ["sky_drive_0.png", "sky_drive_1.png"]
    assert frames_among([Path("a_mask.png"), Path("b_mask.png")]).notes == ()


def test_two_cameras_in_one_folder_are_refused() -> None:
    with pytest.raises(InputError, match=r"2 series of images with the same numbers \(left_#, right_#\)"):
        kept("left_0.png", "left_1.png", "right_0.png", "right_1.png")


@pytest.mark.parametrize(
    "names",
    [
        ("a_0.png", "a_1.png", "b_2.png", "b_3.png"),  # one recording in two parts
        ("1.png", "2.png", "3.png"),
        ("a.png", "b.png"),
        ("2026-11-27_10-00-01.png", "2026-11-27_10-00-02.png"),
    ],
)
def test_one_series_is_taken_as_it_is(names: tuple[str, ...]) -> None:
    assert kept(*names) == list(names)


COPIES = ["1 (1).png", "1 - Copy.png", "1 - Copy (2).png", "1_copy.png", "1 copy 2.png", "Copy of 1.png"]


@pytest.mark.parametrize("copy", COPIES)
def test_a_copy_of_a_frame_is_left_out_and_another_picture_of_such_a_name_is_not(
    copy: str, tmp_path: Path
) -> None:
    files = [tmp_path / name for name in ("0.png", "1.png", copy)]
    for file, content in zip(files, (b"zero", b"one", b"one"), strict=True):
        file.write_bytes(content)
    listed = frames_among(files)
    assert [file.name for file in listed.files] == ["0.png", "1.png"]
    assert listed.notes == (
        f"1 images beside the frames are copies of others in the folder and left out, such as {copy}.",
    )
    files[2].write_bytes(b"two")
    assert frames_among(files).files == tuple(files)


def test_a_copy_of_all_frames_is_no_second_camera(tmp_path: Path) -> None:
    for number in range(3):
        for name in (f"{number}.png", f"Copy of {number}.png"):
            (tmp_path / name).write_bytes(bytes([number]))
    listed = frames_among(sorted(tmp_path.iterdir()))
    assert [file.name for file in listed.files] == ["0.png", "1.png", "2.png"]


@given(st.lists(st.text("ab01_-.masked", min_size=1, max_size=8), unique=True))
def test_a_folder_of_images_is_never_left_without_frames(stems: list[str]) -> None:
    files = [Path(f"{stem}.png") for stem in stems]
    try:
        listed = frames_among(files)
    except InputError:
        return
    assert bool(listed.files) == bool(files)
    assert set(listed.files) <= set(files)
    assert list(listed.files) == [file for file in files if file in set(listed.files)]


def test_many_names_take_little_time() -> None:
    """Names that differ in their case alone, and a mask of each frame."""
    names = [f"{'aB'[k % 2]}{k % 1000:04d}.{'pP'[k // 1000 % 2]}ng" for k in range(20_000)]
    masks = [f"{k:05d}{end}" for k in range(10_000) for end in (".png", "_mask.png")]
    begin_s = time.process_time()
    assert len(kept(*names)) <= 2000
    assert len(kept(*masks)) == 10_000
    assert time.process_time() - begin_s < 3
