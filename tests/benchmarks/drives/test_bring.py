"""Drives brought from a repository: frames and poses as listed, once, or a message of what is wrong."""

import hashlib
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest

from dreamdrive_bench.drives import bring

FRAMES, WIDTH, HEIGHT = 6, 64, 48


def git(folder: Path, *command: str) -> str:
    name = ["-c", "user.name=x", "-c", "user.email=x@example.com", "-c", "commit.gpgsign=false"]
    done = subprocess.run(["git", "-C", folder, *name, *command], check=True, capture_output=True, text=True)
    return done.stdout.strip()


def brightness(number: int) -> int:
    return 40 * number + 20


def make_video(path: Path) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=10)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for number in range(FRAMES):
            image = np.full((HEIGHT, WIDTH, 3), brightness(number), np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="bgr24")))
        container.mux(stream.encode())


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    folder = tmp_path / "there" / "someone" / "drives"
    (folder / "left").mkdir(parents=True)
    make_video(folder / "video.mp4")
    for number in range(4):
        wide = np.full((20, 1300), brightness(number), np.uint8)
        cv2.imwrite(str(folder / "left" / f"{number:03d}.png"), wide)
    (folder / "poses.txt").write_text("".join(f"1 0 0 {row} 0 1 0 0 0 0 1 0\n" for row in range(4)))
    git(folder, "init", "--quiet")
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--message", "x")
    return folder


@pytest.fixture
def listed(repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    def write(*entries: dict[str, Any]) -> None:
        (tmp_path / "sources.json").write_text(json.dumps(entries))

    known = bring.sources
    monkeypatch.setattr(bring, "sources", lambda: known(tmp_path / "sources.json"))
    return write


def digest(*paths: Path) -> str:
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()


def entry(repository: Path, **other: Any) -> dict[str, Any]:
    return {
        "name": "one",
        "kind": "test",
        "repository": "someone/drives",
        "commit": git(repository, "rev-parse", "HEAD"),
        "path": "video.mp4",
        "frames": [1, 4],
        "rate_hz": 10,
        "size": [WIDTH, HEIGHT],
        "sha256": digest(repository / "video.mp4"),
        "meta": {"notes": "grey"},
        **other,
    }


def run(tmp_path: Path, *more: str) -> int:
    return bring.main([*more, "--out", str(tmp_path / "out")])


def frames(folder: Path) -> list[float]:
    return [float(cv2.imread(str(path)).mean()) for path in sorted((folder / "frames").iterdir())]


def test_a_video_is_brought_once(repository: Path, listed: Callable[..., None], tmp_path: Path) -> None:
    listed(entry(repository, left_out=[2]))
    there = ("--repositories", str(tmp_path / "there"))
    assert run(tmp_path, *there) == 0
    folder = tmp_path / "out" / "one"
    np.testing.assert_allclose(frames(folder), [brightness(number) for number in (1, 3, 4)], atol=4)
    meta = json.loads((folder / "meta.json").read_text())
    assert (meta["n_frames"], meta["notes"], meta["poses"]) == (3, "grey", None)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["one"]
    before = (folder / "meta.json").stat().st_mtime_ns
    assert run(tmp_path, *there, "one") == 0
    assert (folder / "meta.json").stat().st_mtime_ns == before
    (folder / "frames" / "000001.jpg").unlink()
    assert run(tmp_path, *there) == 0
    assert len(frames(folder)) == 3


def test_wide_pictures_are_halved_and_have_their_poses(
    repository: Path, listed: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    git(repository, "config", "uploadpack.allowFilter", "true")
    git(repository, "config", "uploadpack.allowAnySHA1InWant", "true")
    monkeypatch.setattr(bring, "HOST", f"file://{tmp_path}/there/")
    pictures = {"path": "left/{:03d}.png", "frames": [2, 3], "size": [650, 10]}
    files = [repository / "left" / f"{number:03d}.png" for number in (2, 3)]
    poses = {"poses": "poses.txt", "poses_sha256": digest(repository / "poses.txt")}
    listed(entry(repository, sha256=digest(*files), **pictures, **poses))
    assert run(tmp_path) == 0
    folder = tmp_path / "out" / "one"
    np.testing.assert_allclose(frames(folder), [brightness(2), brightness(3)], atol=2)
    np.testing.assert_array_equal(np.loadtxt(folder / "poses.txt")[:, 3], [2, 3])
    clone = tmp_path / "out" / ".repositories" / "someone+drives"
    kept = git(clone, "cat-file", "--batch-all-objects", "--batch-check=%(objecttype)").split()
    assert kept.count("blob") == 3


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"sha256": "0"}, "SHA-256"),
        ({"size": [1, 1]}, "64x48, not 1x1"),
        ({"frames": [1, 9]}, "5 frames, not 9"),
        ({"commit": "0" * 40}, "is not in"),
        ({"path": "missing.mp4"}, "cat-file"),
    ],
)
def test_what_is_not_as_listed_is_not_brought(
    repository: Path,
    listed: Callable[..., None],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    other: dict[str, Any],
    message: str,
) -> None:
    listed(entry(repository, **other))
    assert run(tmp_path, "--repositories", str(tmp_path / "there")) == 1
    assert message in capsys.readouterr().err
    assert list((tmp_path / "out").iterdir()) == []


def test_the_list_can_be_read() -> None:
    known = bring.sources()
    assert all(source.kept and source.described()["licence_data"] for source in known.values())
    assert len({source.sha256 for source in known.values()}) > 10
