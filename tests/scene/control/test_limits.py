"""What frames can be asked for."""

import pytest

from dreamdrive.errors import InputError
from dreamdrive.scene.control import check_render_size, limits


def refusal(size: tuple[int, int], *, video: bool = True) -> str:
    with pytest.raises(InputError) as error:
        check_render_size(size, video=video)
    return str(error.value)


def test_sizes_that_cannot_be_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for size in ((0, 0), (15, 40)):
        refused = f"--size {size[0]}x{size[1]}: expected sides of at least 16 pixels"
        assert refusal(size, video=False) == refused
    for size in ((99999, 99999), (8194, 16), (8192, 8192)):
        assert refusal(size, video=False) == (
            f"--size {size[0]}x{size[1]}: too large for H.264 video; expected 8192 pixels a side and 8.9 "
            "million in all at most, such as 3840x2160"
        )
    assert refusal((321, 193)) == ("--size 321x193: a video has even sides; choose 320x192, or --format png")
    monkeypatch.setattr(limits, "free_bytes", lambda: 10**9)
    assert refusal((3840, 2160)) == (
        "--size 3840x2160 takes about 1.7 GB, and 1.0 GB of memory are free; choose a smaller size"
    )
    monkeypatch.setattr(limits, "free_bytes", lambda: None)
    check_render_size((3840, 2160), video=True)
    check_render_size((321, 193), video=False)
