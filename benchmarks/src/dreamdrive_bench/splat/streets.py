"""Streets of Gaussians of any size: those in ``DREAMDRIVE_BENCH``, else of a generator of our own."""

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive_bench.common.places import BENCH

SIZES = {"t": (160, 96, 6_000), "a": (320, 192, 50_000), "b": (640, 384, 200_000), "c": (960, 576, 500_000)}
SEED = 20260101
COMMON = "street_scene.py"


def bench_dir() -> Path | None:
    """Folder of the scenes, or None if they are not there."""
    return BENCH if (BENCH / COMMON).is_file() else None


def load(name: str) -> tuple[str, dict[str, np.ndarray], str]:
    """A scene by letter or ``.npz`` file: its name, arrays, and where it came from."""
    if name.endswith(".npz"):
        with np.load(name) as file:
            return Path(name).stem, dict(file), name
    if name not in SIZES:
        raise SystemExit(f"--scenes: expected t, a, b, c or a file ending in .npz, got {name!r}")
    return name, *street(*SIZES[name])


def street(width: int, height: int, count: int) -> tuple[dict[str, np.ndarray], str]:
    """A street of ``count`` Gaussians seen at ``width`` x ``height``: its arrays and who made it."""
    folder = bench_dir()
    if folder is None:
        where = "stand-in generator (street_scene.py was not found; set DREAMDRIVE_BENCH)"
        return stand_in(width, height, count), where
    spec = importlib.util.spec_from_file_location("street_scene", folder / COMMON)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.SIZES["street"] = (width, height, count)
    return module.make("street", SEED), COMMON


def pinhole_of(arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """The camera of a street as ``rasterize`` takes it."""
    names = {"fx_px": "fx", "fy_px": "fy", "cx_px": "cx", "cy_px": "cy", "width_px": "W", "height_px": "H"}
    return {ours: arrays[theirs].item() for ours, theirs in names.items()}


def surfaces(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) on ground, facades, boxes and far shell of a street along z (y down); their normals."""
    kind = rng.choice(4, count, p=[0.30, 0.45, 0.18, 0.07])
    side = rng.choice([-1.0, 1.0], count)
    z = np.exp(rng.uniform(np.log(3), np.log(60), count))
    ground = np.stack([rng.uniform(-9, 9, count), 1.6 + rng.normal(0, 0.02, count), z], 1)
    facade = np.stack([side * (9 + rng.exponential(0.4, count)), 1.6 - rng.uniform(0, 11, count), z + 3], 1)
    box_z = np.linspace(7, 55, 14)[rng.integers(0, 14, count)]
    box = np.stack([side * (3.8 + rng.uniform(-1, 1, count)), rng.uniform(0.1, 1.6, count), box_z], 1)
    box[:, 2] += rng.uniform(-2.2, 2.2, count)
    far_z = rng.uniform(60, 90, count)
    far = np.stack(
        [rng.uniform(-0.75, 0.75, count) * far_z, rng.uniform(-0.5, 0.02, count) * far_z, far_z], 1
    )
    normals = np.array([[0, -1, 0], [1, 0, 0], [0, 0, -1], [0, 0, -1]], float)[kind]
    normals[kind == 1] *= -side[kind == 1, None]
    return np.choose(kind[:, None], [ground, facade, box, far]), normals


def quaternions_to(normals: np.ndarray, roll: np.ndarray) -> np.ndarray:
    """Rotations (N, 4), wxyz, that roll about z and then turn z onto the unit normals."""
    w = np.sqrt(np.maximum((1 + normals[:, 2]) / 2, 1e-6))
    turn = np.stack([w, -normals[:, 1] / (2 * w), normals[:, 0] / (2 * w), np.zeros_like(w)], 1)
    c, s = np.cos(roll / 2), np.sin(roll / 2)
    tw, tx, ty, _ = turn.T
    out = np.stack([tw * c, tx * c + ty * s, ty * c - tx * s, tw * s], 1)
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def stand_in(width: int, height: int, count: int) -> dict[str, np.ndarray]:
    """A street with the statistics of those scenes: projected sizes, opacities, depth range."""
    rng = np.random.default_rng([SEED, count])
    points, normals = surfaces(rng, count)
    normals = normals + rng.normal(0, 0.12, normals.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    size_px = np.exp(rng.normal(np.log(2.9), 0.55, count))
    large = rng.random(count) < 0.02
    size_px[large] = np.exp(rng.normal(np.log(26), 0.3, large.sum()))
    size = size_px * np.maximum(points[:, 2], 1) / (0.8 * width)
    flat = np.exp(rng.normal(0, 0.35, (count, 2)))
    opacities = np.where(
        rng.random(count) < 0.5, rng.uniform(0.1, 0.99, count), rng.uniform(0.3, 0.99, count)
    )
    opacities[large] = rng.uniform(0.1, 0.35, large.sum())
    view = np.eye(4)
    view[:3, 3] = [0.1, -0.05, 0.2]
    arrays = {
        "means": points - view[:3, 3],
        "quats": quaternions_to(normals, rng.uniform(0, 2 * np.pi, count)),
        "scales": size[:, None] * np.concatenate([flat, rng.uniform(0.1, 0.5, (count, 1))], 1),
        "opacities": opacities,
        "colors": np.clip(0.5 + 0.35 * np.sin(points) + rng.normal(0, 0.12, points.shape), 0.02, 0.98),
        "viewmat": view,
        "v_img": rng.normal(size=(height, width, 3)) / (height * width),
    }
    pinhole = {"fx": 0.8 * width, "fy": 0.8 * width, "cx": width / 2, "cy": height / 2}
    out = {key: np.ascontiguousarray(value, dtype=np.float32) for key, value in arrays.items()}
    out |= {key: np.float32(value) for key, value in pinhole.items()}
    return out | {"W": np.int32(width), "H": np.int32(height)}


def write_bin(scene: dict[str, np.ndarray], path: Path) -> None:
    """The scene in the layout the float64 program reads."""
    with path.open("wb") as file:
        np.array([len(scene["means"]), scene["W"], scene["H"]], np.int32).tofile(file)
        np.array([scene["fx"], scene["fy"], scene["cx"], scene["cy"]], np.float32).tofile(file)
        for key in ("viewmat", "means", "quats", "scales", "opacities", "colors"):
            np.ascontiguousarray(scene[key], np.float32).tofile(file)
