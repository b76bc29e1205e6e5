"""Gaussians as SOG, SuperSplat's format for the web: bytes as lossless WebP in a zip, axes as PLY has them.

Source: the format's description by PlayCanvas, version 2.
"""

import io
import json
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image

from dreamdrive.data.splats.splats import arrays_of
from dreamdrive.export.stills import Still, left_out_of_stills, write_stills
from dreamdrive.files.kinds import SOG_KIND
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene

_LEVELS = 256
_ROUNDS = 20
_PALETTE = 2048
"""Further colours that are told apart."""
_IN_A_ROW = 64
_LARGEST_IS = 252
_LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""The time of all files in the zip, so that the same scene gives the same bytes."""


def scene_to_sog(
    scene: Scene,
    path: Path,
    *,
    times_s: Sequence[float] | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a scene as SOG: one file for a name ending in ``.sog``, else a folder, see ``write_stills``.

    Positions have 16 bits an axis, rotations 26, opacities 8, sizes and colours 256 levels each; further
    colours are those of 2048 that are nearest.

    Raises:
        InputError: The path cannot be written, or the times do not grow.
    """
    write_stills(scene, path, _SOG, times_s=times_s, replace=replace, progress=progress)


def left_out_of_sog(scene: Scene, path: Path) -> str:
    """What of a scene ``scene_to_sog`` finds no place for, in a sentence."""
    return left_out_of_stills(scene, path, _SOG)


def pack_sog(gaussians: Gaussians) -> bytes:
    """A SOG file."""
    numbers = arrays_of(gaussians)
    count, coefficients = numbers.sh.shape[:2]
    logs = np.sign(numbers.means) * np.log1p(np.abs(numbers.means.astype(np.float64)))
    low, high = logs.min(axis=0, initial=np.inf), logs.max(axis=0, initial=-np.inf)
    if not count:
        low, high = np.zeros(3), np.zeros(3)
    wholes = np.rint((logs - low) / np.maximum(high - low, 1e-9) * 65535).astype(np.uint16)
    scales, scale_levels = _levels(numbers.log_scales)
    colours, colour_levels = _levels(numbers.sh[:, 0])
    opacities = 255 / (1 + np.exp(-numbers.logit_opacities.astype(np.float64)))
    pictures = {
        "means_l.webp": _pixels(wholes & 255),
        "means_u.webp": _pixels(wholes >> 8),
        "quats.webp": _pixels(_turns(numbers.quaternions)),
        "scales.webp": _pixels(scales),
        "sh0.webp": _pixels(np.concatenate([colours, np.rint(opacities)[:, None]], axis=1)),
    }
    about: dict[str, Any] = {
        "version": 2,
        "asset": {"generator": "dreamdrive"},
        "count": count,
        "means": {
            "mins": low.tolist(),
            "maxs": high.tolist(),
            "files": ["means_l.webp", "means_u.webp"],
        },
        "scales": {"codebook": scale_levels.tolist(), "files": ["scales.webp"]},
        "quats": {"files": ["quats.webp"]},
        "sh0": {"codebook": colour_levels.tolist(), "files": ["sh0.webp"]},
    }
    if coefficients > 1 and count:
        more, about["shN"] = _further(numbers.sh[:, 1:])
        pictures |= more
    return _zip({**{name: _webp(each) for name, each in pictures.items()}, "meta.json": json.dumps(about)})


def _levels(
    values: Float[np.ndarray, "n 3"],
) -> tuple[UInt8[np.ndarray, "n 3"], Float[np.ndarray, " l"]]:
    """The nearest of 256 levels of each number, and the levels, in Lloyd's way."""
    flat = np.sort(values.astype(np.float64).ravel())
    if not len(flat):
        return np.zeros((0, 3), np.uint8), np.zeros(_LEVELS)
    half = _LEVELS // 2
    levels = np.concatenate(
        [np.linspace(flat[0], flat[-1], half), np.quantile(flat, np.linspace(0, 1, half))]
    )
    for _ in range(_ROUNDS):
        levels = np.sort(levels)
        nearest = np.searchsorted((levels[1:] + levels[:-1]) / 2, flat)
        counts = np.bincount(nearest, minlength=_LEVELS)
        sums = np.bincount(nearest, flat, _LEVELS)
        levels = np.where(counts > 0, sums / np.maximum(counts, 1), levels)
    levels = np.sort(levels)
    return np.searchsorted((levels[1:] + levels[:-1]) / 2, values).astype(np.uint8), levels


def _turns(quaternions: Float[np.ndarray, "n 4"]) -> UInt8[np.ndarray, "n 4"]:
    """The three smaller of w, x, y, z in bytes, and which is the largest, made positive."""
    largest = np.abs(quaternions).argmax(axis=1)
    signs = np.where(np.take_along_axis(quaternions, largest[:, None], 1) < 0, -1, 1)
    smaller = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[largest]
    three = np.take_along_axis(quaternions * signs, smaller, 1) * 2**0.5
    wholes = np.clip(np.rint((three + 1) / 2 * 255), 0, 255)
    return np.concatenate([wholes, _LARGEST_IS + largest[:, None]], axis=1).astype(np.uint8)


def _further(
    sh: Float[np.ndarray, "n k 3"],
) -> tuple[dict[str, UInt8[np.ndarray, "h w c"]], dict[str, Any]]:
    """Pictures of a palette of further colours and of what each Gaussian takes, and what to say of them."""
    count, coefficients = sh.shape[:2]
    palette, labels = _palette(sh.reshape(count, -1))
    indices, levels = _levels(palette.reshape(-1, 3))
    rows = -(-len(palette) // _IN_A_ROW)
    centroids = np.zeros((rows * _IN_A_ROW * coefficients, 3), np.uint8)
    centroids[: len(indices)] = indices
    names = ["shN_centroids.webp", "shN_labels.webp"]
    two = np.stack([labels & 255, labels >> 8, np.zeros_like(labels)], axis=1)
    pictures = centroids.reshape(rows, _IN_A_ROW * coefficients, 3), _pixels(two)
    about = {"count": len(palette), "bands": int((coefficients + 1) ** 0.5) - 1, "codebook": levels.tolist()}
    return dict(zip(names, pictures, strict=True)), {**about, "files": names}


def _palette(values: Float[np.ndarray, "n c"]) -> tuple[Float[np.ndarray, "p c"], np.ndarray]:
    """At most 2048 rows that are near all rows, and which is nearest to each."""
    different, labels = np.unique(values, axis=0, return_inverse=True)
    if len(different) <= _PALETTE:
        return different, labels.ravel()
    from sklearn.cluster import MiniBatchKMeans

    # Its annotations know n_init as a word alone.
    found: Any = MiniBatchKMeans(
        _PALETTE,
        init="random",
        random_state=0,
        n_init=1,  # pyright: ignore[reportArgumentType]
        batch_size=8192,
        max_iter=5,
    ).fit(values)
    return found.cluster_centers_, found.labels_


def _pixels(rows: np.ndarray) -> UInt8[np.ndarray, "h w c"]:
    """Rows as a picture, sides a multiple of four."""
    width = max(4, 4 * int(np.ceil(len(rows) ** 0.5 / 4)))
    height = max(4, 4 * -(-len(rows) // (4 * width)))
    filled = np.zeros((width * height, rows.shape[1]), np.uint8)
    filled[: len(rows)] = rows
    return filled.reshape(height, width, rows.shape[1])


def _webp(picture: UInt8[np.ndarray, "h w c"]) -> bytes:
    data = io.BytesIO()
    # Exact: what is transparent keeps its numbers.
    Image.fromarray(picture).save(data, "WEBP", lossless=True, exact=True, quality=50)
    return data.getvalue()


def _zip(files: dict[str, bytes | str]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name, _LONG_AGO), content)
    return data.getvalue()


_SOG = Still("SOG", ".sog", SOG_KIND, pack_sog)
