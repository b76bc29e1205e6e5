from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import pytest

from dreamdrive.data.video_writer import write_video
from dreamdrive.errors import InputError


def frames(count: int = 6, height: int = 48, width: int = 64) -> list[np.ndarray]:
    y, x = np.mgrid[:height, :width]
    pictures = [np.stack([4 * x, 4 * y, 0 * x + 30 * i], -1) % 256 // 2 + 60 for i in range(count)]
    return [p.astype(np.uint8) for p in pictures]


def read(path: Path) -> tuple[np.ndarray, float]:
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        rate = float(stream.average_rate or 0)
        return np.stack([f.to_ndarray(format="rgb24") for f in container.decode(stream)]), rate


def test_what_is_written_is_what_is_read(tmp_path: Path) -> None:
    smooth = [np.clip(f, 60, 180) for f in frames()]
    assert write_video(tmp_path / "a.mp4", iter(smooth), 12.5) == 6
    decoded, rate = read(tmp_path / "a.mp4")
    assert decoded.shape == (6, 48, 64, 3)
    assert rate == 12.5
    assert np.abs(decoded.astype(int) - np.stack(smooth)).mean() < 3


def test_colours_come_back_right(tmp_path: Path) -> None:
    wanted = np.array([[200, 40, 40], [40, 180, 60], [50, 60, 190], [128, 128, 128]], dtype=np.uint8)
    picture = np.repeat(np.repeat(wanted.reshape(2, 2, 3), 32, 0), 32, 1)
    write_video(tmp_path / "a.mp4", [picture], 10.0)
    with av.open(str(tmp_path / "a.mp4")) as container:
        frame = next(container.decode(video=0))
        assert int(frame.colorspace) == 1  # says BT.709
        back = frame.reformat(format="rgb24", src_colorspace="ITU709").to_ndarray()
    assert np.abs(back[16::32, 16::32].astype(int) - wanted.reshape(2, 2, 3)).max() <= 5


def test_float_frames_equal_byte_frames_and_equal_input_gives_equal_bytes(tmp_path: Path) -> None:
    write_video(tmp_path / "a.mp4", frames(), 10.0)
    write_video(tmp_path / "b.mp4", [f / 255 for f in frames()], 10.0)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()


@pytest.mark.parametrize("size", [(47, 65), (48, 65), (47, 64), (1, 1), (2, 3)])
def test_odd_sizes_are_padded_to_even(tmp_path: Path, size: tuple[int, int]) -> None:
    write_video(tmp_path / "a.mp4", frames(2, *size), 10.0)
    decoded, _ = read(tmp_path / "a.mp4")
    assert decoded.shape[1:3] == (size[0] + size[0] % 2, size[1] + size[1] % 2)


def failing() -> Iterator[np.ndarray]:
    yield from frames(3)
    raise RuntimeError("stopped half-way")


def test_a_failure_half_way_leaves_what_was_there(tmp_path: Path) -> None:
    write_video(tmp_path / "a.mp4", frames(), 10.0)
    before = (tmp_path / "a.mp4").read_bytes()
    with pytest.raises(RuntimeError, match="half-way"):
        write_video(tmp_path / "a.mp4", failing(), 10.0)
    assert (tmp_path / "a.mp4").read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_unwritable_places_are_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot write"):
        write_video(tmp_path / "file" / "a.mp4", frames(), 10.0)
    (tmp_path / "taken.mp4").mkdir()
    (tmp_path / "taken.mp4" / "mine").write_text("x")
    with pytest.raises(InputError, match="cannot write"):
        write_video(tmp_path / "taken.mp4", frames(), 10.0)


def test_wrong_use_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="at least one"):
        write_video(tmp_path / "a.mp4", [], 10.0)
    with pytest.raises(ValueError, match="fps"):
        write_video(tmp_path / "a.mp4", frames(), 0.0)
    with pytest.raises(ValueError, match="first one"):
        write_video(tmp_path / "a.mp4", [*frames(1), *frames(1, 20, 20)], 10.0)
    assert not any(tmp_path.iterdir())
