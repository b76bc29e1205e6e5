"""The C++ programs of the benchmark, compiled once for each state of their source, outside the repository."""

import hashlib
import json
import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from dreamdrive_bench.splat.streets import bench_dir, write_bin

HERE = Path(__file__).parent
Scene = dict[str, np.ndarray]
FLAGS = ["-O3", "-march=native", "-std=c++17", "-pthread"]


def cache_dir() -> Path:
    """A folder of this machine: what is compiled for it need not run on another."""
    folder = Path(tempfile.gettempdir()) / f"dreamdrive-bench-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    if folder.stat().st_uid != os.getuid():
        raise SystemExit(f"{folder} belongs to someone else: remove it, or choose another place with TMPDIR")
    return folder


def compiler() -> str | None:
    """The C++ compiler: CXX, else g++, else clang++; None if there is none."""
    return shutil.which(os.environ.get("CXX", "g++")) or shutil.which("clang++")


@cache
def compiled(source: Path) -> Path | None:
    """The program made of ``source``, or None without a compiler."""
    command = compiler()
    if command is None:
        return None
    digest = hashlib.sha256(source.read_bytes() + " ".join([command, *FLAGS]).encode()).hexdigest()[:12]
    program = cache_dir() / f"{source.stem}-{digest}"
    if not program.exists():
        subprocess.run([command, *FLAGS, "-o", f"{program}.new", source], check=True)
        Path(f"{program}.new").rename(program)
    return program


def measure_peaks(threads: int) -> dict[str, float] | None:
    """Peaks of ``threads`` cores at once (see peaks.cpp), or None without a compiler."""
    program = compiled(HERE / "peaks.cpp")
    if program is None:
        return None
    return json.loads(subprocess.run([program, str(threads)], check=True, capture_output=True).stdout)


def walk(scene: Scene, lanes: int) -> tuple[dict[str, int], np.ndarray] | None:
    """The work of rendering a scene with rows of ``lanes`` pixels, and its float64 image (see work.cpp)."""
    program = compiled(HERE / "work.cpp")
    if program is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        write_bin(scene, Path(folder) / "scene.bin")
        command = [program, "scene.bin", "image.bin", str(lanes)]
        output = subprocess.run(command, cwd=folder, check=True, capture_output=True).stdout
        return json.loads(output), read_image(Path(folder) / "image.bin", scene)


def common_image(scene: Scene) -> np.ndarray | None:
    """The scene in float64 by the program in ``DREAMDRIVE_BENCH``; None without it or a compiler.

    It takes minutes for large scenes, so that its images are kept.
    """
    folder = bench_dir()
    program = None if folder is None else compiled(folder / "reference_f64.cpp")
    if program is None:
        return None
    with tempfile.TemporaryDirectory() as work:
        write_bin(scene, Path(work) / "scene.bin")
        digest = hashlib.sha256((Path(work) / "scene.bin").read_bytes()).hexdigest()[:12]
        image = cache_dir() / f"{program.name}-{digest}.image"
        if not image.exists():
            command = [program, "scene.bin", "image.bin"]
            subprocess.run(command, cwd=work, check=True, capture_output=True)
            shutil.move(Path(work) / "image.bin", image)
    return read_image(image, scene)


def read_image(path: Path, scene: Scene) -> np.ndarray:
    """The image (h, w, 3) that a file begins with."""
    shape = (scene["H"].item(), scene["W"].item(), 3)
    return np.fromfile(path, np.float32, count=int(np.prod(shape))).reshape(shape)
