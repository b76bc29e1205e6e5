"""One page of HTML that plays a scene from disk: what stands and what moves, sky and exposure."""

import base64
import json
import zlib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Shaped

from dreamdrive.errors import InputError
from dreamdrive.export.moving import AtMoments, at_moments, joined, moments_of
from dreamdrive.files.output import check_ending, check_new_file, new_file
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.scene import Scene

_MOST_BYTES = 350_000_000
"""What browsers can hold as one text, in base64, with room to spare."""
_TYPES = {"float32": "f4", "float16": "f2", "uint32": "u4", "uint8": "u1"}
_PARTS = ("page.html", "shaders.js", "page.js")


def scene_to_page(
    scene: Scene,
    path: Path,
    *,
    times_s: Sequence[float] | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a page that plays a scene in any browser with WebGL 2, opened from disk.

    What moves is written at moments, between which the page moves it straight; life spans fade exactly.
    Means are float32, rotations, sizes and colours float16, the sky has 8 bits. The page is a program of its
    own, as no viewer has life spans, exposure and a pinhole whose middle lies anywhere.

    Args:
        scene: The scene.
        path: A name ending in ``.html``.
        times_s: The moments, which grow; the recorded times where none are given.
        replace: Replace what is there already.
        progress: Told when it is written.

    Raises:
        InputError: The path cannot be written, or the scene is too large for a page.
    """
    check_ending(path, ".html")
    check_new_file(path, replace)
    moments_s = moments_of(scene, times_s)
    data, about = _packed(scene, moments_s)
    template, shaders, program = (
        files("dreamdrive.export.page").joinpath(name).read_text("utf-8") for name in _PARTS
    )
    parts = {
        "@NUMBERS@": base64.b64encode(data).decode("ascii"),
        "@SCENE@": json.dumps(about).replace("<", "\\u003c"),
        "@SHADERS@": shaders,
        "@PAGE@": program,
    }
    with new_file(path) as partial, partial.open("w", encoding="utf-8") as page:
        for piece in _pieces(template, parts):
            page.write(piece)
    progress(1, 1)


def left_out_of_page(scene: Scene, path: Path) -> str:
    """What of a scene the page leaves out, in a sentence."""
    del path
    missing = []
    if scene.moves_per_frame or len(scene.dynamic):
        missing.append("between the moments written, motion is straight")
    if scene.deformation is not None and scene.deformation.kind == "hexplane":
        missing.append("colours do not change over time")
    if scene.camera is not None:
        missing.append("exposure is that of the first camera")
    return (
        "The page plays the scene with its sky and exposure" + "".join(f"; {each}" for each in missing) + "."
    )


def _pieces(template: str, parts: Mapping[str, str]) -> list[str]:
    """A template with its places filled, each once and in their order there."""
    pieces: list[str] = []
    for name, text in parts.items():
        before, _, template = template.partition(name)
        pieces += [before, text]
    return [*pieces, template]


def _packed(scene: Scene, moments_s: Float[np.ndarray, " t"]) -> tuple[bytes, dict[str, Any]]:
    """The compressed numbers of a scene, and what the page knows of it and of them."""
    both = joined(at_moments(scene, moments_s))
    start_s = float(moments_s[0])
    arrays = _arrays(both, start_s)
    if scene.sky is not None:
        arrays["sky"] = scene.sky.texture.clamp(0, 1).mul(255).round().to(torch.uint8).numpy(force=True)
    size = sum(each.nbytes for each in arrays.values())
    if size > _MOST_BYTES:
        raise InputError(
            f"the page would hold {size / 1e6:.0f} MB of numbers, a browser takes "
            f"{_MOST_BYTES / 1e6:.0f} MB; choose fewer times, or a part of the scene"
        )
    places: dict[str, dict[str, Any]] = {}
    start = 0
    for name, values in arrays.items():
        places[name] = {"type": _TYPES[str(values.dtype)], "start": start, "count": int(values.size)}
        start += values.nbytes
    data = b"".join(np.ascontiguousarray(each).tobytes() for each in arrays.values())
    return zlib.compress(data, 6), {"arrays": places, **_about(scene, moments_s, both.sh.shape[1])}


def _arrays(both: AtMoments, start_s: float) -> dict[str, Shaped[np.ndarray, "..."]]:
    """By name, those of the widest numbers first, so that each starts where its type may."""
    opacities = both.opacities.astype("<f4").view("<u4")
    rows = np.stack([both.offsets, both.first, both.last, opacities], axis=1)
    lives_s = both.lives_s - np.where(both.lives_s[:, 1:] > 0, [[start_s, 0.0]], 0.0)
    return {
        "rows": rows.astype("<u4"),
        "lives": lives_s.astype("<f4"),
        "places": both.means.astype("<f4"),
        "turns": both.quaternions.astype("<f2"),
        "sizes": both.log_scales.clip(-60_000, 60_000).astype("<f2"),
        "colours": both.sh.clip(-60_000, 60_000).astype("<f2"),
    }


def _about(scene: Scene, moments_s: Float[np.ndarray, " t"], coefficients: int) -> dict[str, Any]:
    """What the page is told in JSON; times there count from the first moment."""
    camera, start_s = scene.cameras[int(scene.front[0])], float(moments_s[0])
    drive = scene.trajectory
    names = ("fx_px", "fy_px", "cx_px", "cy_px", "width_px", "height_px")
    sky, exposure = scene.sky, None
    if scene.exposure is not None:
        transforms, times_s = scene.exposure.of(scene.of_rig(int(scene.front[0])))
        exposure = {
            "times_s": (times_s - start_s).tolist(),
            "transforms": transforms.reshape(-1, 12).tolist(),
        }
    return {
        "title": scene.provenance.input or "DreamDrive",
        "start_s": start_s,
        "length_s": float(moments_s[-1]) - start_s,
        "moments_s": (moments_s - start_s).tolist(),
        "path_s": (drive.times_s - start_s).tolist(),
        "path": drive.world_from_camera.reshape(-1, 16).tolist(),
        "camera": {name: getattr(camera, name) for name in names},
        "up": scene.up.tolist(),
        "coefficients": coefficients,
        "exposure": exposure,
        "sky": None
        if sky is None
        else {
            "size": [sky.texture.shape[1], sky.texture.shape[0]],
            "azimuth_rad": sky.azimuth_rad,
            "elevation_rad": sky.elevation_rad,
        },
    }
