"""A clip at the size of the paper by Vista with random weights, from a photo to frames and features."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
import torch
from safetensors.torch import save_file

from dreamdrive.prior.vista.condition import embed_action
from dreamdrive.prior.vista.engine import Engine
from dreamdrive.prior.vista.features import Window, extract
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.memory import Job
from dreamdrive.prior.vista.picture import to_frames, to_images
from dreamdrive.prior.vista.rollout import SCALE, decode_in_chunks, roll_out
from dreamdrive.prior.vista.stored import FILES, open_weights
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.gpu.video_models import size_of
from dreamdrive_bench.gpu.weights import video_model, video_model_configs

STEPS = 3


def measure(figures: Figures, pack: Path) -> None:
    """Weights on disk, then the steps of the prior, each with its seconds and its peak."""
    with TemporaryDirectory() as folder:
        _stage(figures, "weights made and written", lambda: _write_weights(figures, Path(folder)))
        begin = time.perf_counter()
        _make(figures, Path(folder), _photo(pack, size_of(figures)))
        figures.put("whole_s", time.perf_counter() - begin)


def _write_weights(figures: Figures, folder: Path) -> None:
    """In the layout of diffusers and half precision."""
    model = video_model(VISTA, figures.device, tiny=figures.pretended)
    for part, config in video_model_configs(VISTA, tiny=figures.pretended).items():
        own = model.parts[part]
        (folder / part).mkdir()
        (folder / part / "config.json").write_text(json.dumps(config))
        save_file({name: own.read(name).half() for name in own.shapes}, folder / part / FILES[part][0])


def _photo(pack: Path, size: tuple[int, int]) -> np.ndarray:
    photo = cv2.imread(str(sorted(pack.glob("*.jpg"))[0]))
    return cv2.cvtColor(cv2.resize(photo, size), cv2.COLOR_BGR2RGB)[None]


@torch.inference_mode()
def _make(figures: Figures, weights: Path, photo: np.ndarray) -> None:
    """What ``prior.vista.make`` does with the networks."""
    engine = Engine(open_weights(weights, VISTA), figures.device)
    count, (width, height) = engine.per_round, size_of(figures)
    engine.check_fit(Job((width, height), count, count))
    images, action = to_images(photo), embed_action({})
    noise = torch.randn(1, count, 4, height // 8, width // 8).to(figures.device)
    for name, part in (("describe", "image_encoder"), ("encode", "vae")):
        run = getattr(engine, name)
        _stage(figures, f"{part} loaded and run", lambda: run(images))  # noqa: B023
    _stage(figures, "UNet loaded", lambda: engine.network("unet"))
    steps = 1 if figures.pretended else STEPS
    latents = _stage(
        figures,
        f"sampled in {steps} steps, all networks loaded again",
        lambda: roll_out(engine, VISTA, images, noise, [action], steps).cpu(),
    )
    decoded = _stage(figures, "decoded", lambda: decode_in_chunks(engine.decode, latents / SCALE))
    figures.put("finite", bool(torch.isfinite(decoded).all()))
    frames = to_frames(decoded.nan_to_num(0))
    windows = [Window(range(count), action, 1)]
    features = _stage(figures, "features", lambda: extract(engine, latents, frames, windows))
    figures.put("frames", list(frames.shape))
    figures.put("features_of", list(features.shape))


def _stage(figures: Figures, name: str, run: Callable[[], Any]) -> Any:
    made: list[Any] = []
    taken = figures.timed(lambda: made.append(run()), again=0)
    figures.put("stages", name, taken)
    return made[0]
