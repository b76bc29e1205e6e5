import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import pytest

from dreamdrive.data.pictures.video_writer import write_video
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


# Frames that move and fade, which x264 predicts from each other both ways; says what the files hash to.
DRIFTING = """
import hashlib, sys
from pathlib import Path
import cv2, numpy as np
from dreamdrive.data.pictures.video_writer import write_video
path, width, height, times = Path(sys.argv[1]), *map(int, sys.argv[2:])
noise = np.random.default_rng(0).integers(0, 255, (height // 16 + 2, width // 16 + 3, 3), np.uint8)
wide = cv2.resize(noise, None, fx=16, fy=16)
frames = [wide[:height, i : i + width] * ((1 - i / 32) / 255) for i in range(16)]
for _ in range(times):
    write_video(path, frames, 10.0)
    print(hashlib.sha256(path.read_bytes()).hexdigest())
"""


def hashes(path: Path, size: tuple[int, int], times: int, fill: int) -> set[str]:
    """What equal frames hash to in a process of its own, where the C library fills new memory with a byte."""
    command = [sys.executable, "-c", DRIFTING, str(path), *map(str, size), str(times)]
    environment = {**os.environ, "MALLOC_PERTURB_": str(fill)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_bytes_do_not_depend_on_what_memory_held_before(tmp_path: Path) -> None:
    found = [hashes(tmp_path / "a.mp4", (162, 98), 2, fill) for fill in (1, 128)]
    assert len(set.union(*found)) == 1


@pytest.mark.slow
@pytest.mark.parametrize("size", [(480, 270), (320, 192), (162, 98)])
def test_twenty_writes_beside_busy_processes_give_one_file(tmp_path: Path, size: tuple[int, int]) -> None:
    busy = [subprocess.Popen([sys.executable, "-c", "while True: bytearray(10**6)"]) for _ in range(2)]
    try:
        found = [hashes(tmp_path / "a.mp4", size, 5, fill) for fill in (0, 1, 128, 255)]
    finally:
        for process in busy:
            process.kill()
            process.wait()
    assert len(set.union(*found)) == 1


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
    with pytest.raises(InputError, match="no regular file"):
        write_video(tmp_path / "taken.mp4", frames(), 10.0)


def test_wrong_use_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="at least one"):
        write_video(tmp_path / "a.mp4", [], 10.0)
    with pytest.raises(ValueError, match="fps"):
        write_video(tmp_path / "a.mp4", frames(), 0.0)
    with pytest.raises(ValueError, match="first one"):
        write_video(tmp_path / "a.mp4", [*frames(1), *frames(1, 20, 20)], 10.0)
    assert not any(tmp_path.iterdir())
