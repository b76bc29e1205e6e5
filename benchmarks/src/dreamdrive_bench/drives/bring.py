"""Recorded drives from public repositories: brings those of ``sources.json`` to where the table looks.

Each becomes ``OUT/NAME/frames/NNNNNN.jpg`` and ``OUT/NAME/meta.json``, and ``poses.txt`` where the path of
the camera is known. What is there and complete is left alone. Without ``--repositories`` git fetches the one
commit and the few files that are needed; with it, repositories are found below DIR as ``OWNER+NAME`` or
``OWNER/NAME``, bare or with a work tree. The recordings belong to those who made them; each ``meta.json``
says what is known of its licence.
"""

import argparse
import hashlib
import io
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

from dreamdrive_bench.common.places import ROOT

SOURCES = Path(__file__).parent / "sources.json"
OUT = ROOT / "runs/data/drives"
HOST = "https://github.com/"
QUALITY, WIDEST = 92, 1280
INSIDE = (".", ".git", "repo", "repo/.git")
"""Where the git directory of a repository may lie in its folder."""


@dataclass(frozen=True)
class Source:
    """A piece of a recording in a repository.

    Attributes:
        name: Of its folder.
        kind: What it is an example of.
        repository: ``OWNER/NAME``.
        commit: Of the repository.
        path: A video, or the name of a picture with ``{}`` for its number.
        frames: First and last frame, counted from 0 in a video, numbers of pictures otherwise.
        rate_hz: Of the frames that are kept.
        size: Width and height in pixels of the frames that are written.
        sha256: Of the source file; of all pictures one after another where there are many.
        meta: What else is known, as ``meta.json`` has it.
        left_out: Frames between the first and the last that repeat the one before.
        poses: File with one camera pose a line.
        poses_sha256: Of that file.
    """

    name: str
    kind: str
    repository: str
    commit: str
    path: str
    frames: tuple[int, int]
    rate_hz: float
    size: tuple[int, int]
    sha256: str
    meta: dict[str, Any]
    left_out: tuple[int, ...] = ()
    poses: str | None = None
    poses_sha256: str | None = None

    @property
    def kept(self) -> list[int]:
        """Numbers of the frames that are written."""
        first, last = self.frames
        return [number for number in range(first, last + 1) if number not in self.left_out]

    @property
    def pictures(self) -> bool:
        """Whether the source is a folder of pictures."""
        return "{" in self.path

    @property
    def files(self) -> list[str]:
        """The files of the frames in the repository."""
        return [self.path.format(number) for number in self.kept] if self.pictures else [self.path]

    def described(self) -> dict[str, Any]:
        """The content of ``meta.json``."""
        first, last = self.frames
        skipped = f", without {len(self.left_out)} that repeat" if self.left_out else ""
        return {
            "name": self.name,
            "kind": self.kind,
            "source_repo": self.repository,
            "commit": self.commit,
            "path": f"{self.path} frames {first}..{last}{skipped}",
            "fps": self.rate_hz,
            "width": self.size[0],
            "height": self.size[1],
            "n_frames": len(self.kept),
            "poses": None if self.poses is None else "poses.txt",
            "source_sha256": self.sha256,
            **self.meta,
        }


def sources(path: Path = SOURCES) -> dict[str, Source]:
    """All sources by name."""
    found = {}
    for one in json.loads(path.read_text()):
        pairs = {key: tuple(one[key]) for key in ("frames", "size", "left_out") if key in one}
        found[one["name"]] = Source(**{**one, **pairs})
    return found


def main(arguments: list[str] | None = None) -> int:
    """Bring what was asked for; 1 if something could not be brought."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    known = sources()
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(known)}; all unless given")
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR", help="where the drives go")
    parser.add_argument("--repositories", type=Path, metavar="DIR", help="copies that are there already")
    args = parser.parse_args(arguments)
    if unknown := set(args.names) - set(known):
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    failed = 0
    for name in args.names or known:
        try:
            print(name, bring(known[name], args.out, args.repositories), flush=True)
        except (OSError, ValueError, subprocess.CalledProcessError) as error:
            failed += 1
            print(f"{name}: {error}", file=sys.stderr, flush=True)
    return int(failed > 0)


def bring(source: Source, out: Path, repositories: Path | None) -> str:
    """Write a drive unless it is there; says which."""
    folder = out / source.name
    if complete(source, folder):
        return "is there"
    out.mkdir(parents=True, exist_ok=True)
    git = fetched(source, out / ".repositories") if repositories is None else found(source, repositories)
    with tempfile.TemporaryDirectory(dir=out, prefix=f".{source.name}-") as made:
        new = Path(made) / "new"
        write(source, git, new)
        if folder.exists():
            folder.rename(Path(made) / "old")
        new.rename(folder)
    return "brought"


def complete(source: Source, folder: Path) -> bool:
    """Whether all files of a drive are there, from the source as it is listed."""
    meta = folder / "meta.json"
    if not meta.exists() or json.loads(meta.read_text()) != json.loads(json.dumps(source.described())):
        return False
    wanted = {f"{index:06d}.jpg" for index in range(len(source.kept))}
    there = {path.name for path in (folder / "frames").iterdir()}
    return there == wanted and (source.poses is None or (folder / "poses.txt").exists())


def found(source: Source, repositories: Path) -> Path:
    """The git directory of a source's repository below a folder.

    Raises:
        FileNotFoundError: if none there has the commit.
    """
    for name in (source.repository.replace("/", "+"), source.repository):
        for inside in INSIDE:
            git = repositories / name / inside
            if (git / "HEAD").exists() and _git(git, "cat-file", "-t", source.commit, check=False):
                return git
    raise FileNotFoundError(f"{source.repository} at {source.commit[:12]} is not in {repositories}")


def fetched(source: Source, clones: Path) -> Path:
    """A clone that has the one commit, and of its files those that the source names."""
    git = clones / source.repository.replace("/", "+")
    if not (git / "HEAD").exists():
        subprocess.run(["git", "init", "--quiet", "--bare", str(git)], check=True)
        _git(git, "remote", "add", "origin", HOST + source.repository)
    once = ["fetch", "--quiet", "--no-tags", "--no-write-fetch-head", "--filter=blob:none"]
    _git(git, *once, "--depth=1", "origin", source.commit)
    wanted = set(source.files) | ({source.poses} if source.poses else set())
    listed = _git(git, "ls-tree", "-r", "-z", source.commit).decode().split("\0")
    blobs = [line.split()[2] for line in listed if line and line.split("\t", 1)[1] in wanted]
    # All in one request; git alone would ask for each picture by itself.
    _git(git, *once, "--stdin", "origin", given="\n".join(blobs).encode())
    return git


def write(source: Source, git: Path, folder: Path) -> None:
    """Frames, poses and what is known of them.

    Raises:
        ValueError: if the source is not the listed one, or its frames are not as listed.
    """
    (folder / "frames").mkdir(parents=True)
    blobs = [_blob(git, source, path) for path in source.files]
    _check(source.path, b"".join(blobs), source.sha256)
    count = 0
    for index, (data, size) in enumerate(_pictures(blobs) if source.pictures else _video(source, blobs[0])):
        if size != source.size:
            raise ValueError(f"frame {index} is {size[0]}x{size[1]}, not {source.size[0]}x{source.size[1]}")
        (folder / "frames" / f"{index:06d}.jpg").write_bytes(data)
        count = index + 1
    if count != len(source.kept):
        raise ValueError(f"{count} frames, not {len(source.kept)}")
    if source.poses is not None:
        text = _blob(git, source, source.poses)
        _check(source.poses, text, source.poses_sha256)
        rows = text.decode().splitlines()
        (folder / "poses.txt").write_text("".join(f"{rows[number]}\n" for number in source.kept))
    described = json.dumps(source.described(), indent=1, ensure_ascii=False)
    (folder / "meta.json").write_text(described + "\n")


def _pictures(blobs: list[bytes]) -> Iterator[tuple[bytes, tuple[int, int]]]:
    """Pictures as JPEG with their size; those that are JPEG and small enough stay as they are."""
    for blob in blobs:
        image = cv2.imdecode(np.frombuffer(blob, np.uint8), cv2.IMREAD_UNCHANGED)
        if image is None:
            raise ValueError("a picture cannot be read")
        data, size = _encoded(image)
        yield (blob if blob[:2] == b"\xff\xd8" and image.shape[1] == size[0] else data), size


def _video(source: Source, blob: bytes) -> Iterator[tuple[bytes, tuple[int, int]]]:
    """The frames of a video that are kept, as JPEG with their size."""
    kept = set(source.kept)
    with av.open(io.BytesIO(blob)) as container:
        for number, frame in enumerate(container.decode(video=0)):
            if number > source.frames[1]:
                return
            if number in kept:
                yield _encoded(frame.to_ndarray(format="bgr24"))


def _encoded(image: np.ndarray) -> tuple[bytes, tuple[int, int]]:
    """An image as JPEG, halved where it is very wide."""
    if image.shape[1] > WIDEST:
        image = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return data.tobytes(), (image.shape[1], image.shape[0])


def _check(path: str, data: bytes, expected: str | None) -> None:
    """Raise a ``ValueError`` where a file is not the listed one."""
    digest = hashlib.sha256(data).hexdigest()
    if digest != expected:
        raise ValueError(f"{path} has the SHA-256 {digest}, not {expected}")


def _blob(git: Path, source: Source, path: str) -> bytes:
    """The content of a file at the commit of a source."""
    return _git(git, "cat-file", "blob", f"{source.commit}:{path}")


def _git(git: Path, *command: str, given: bytes | None = None, check: bool = True) -> bytes:
    """What a git command prints."""
    whole = ["git", "--git-dir", str(git), *command]
    return subprocess.run(whole, input=given, check=check, capture_output=True).stdout
