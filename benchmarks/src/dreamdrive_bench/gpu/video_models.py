"""Vista and SVD at their size: seconds and memory of each network, a step of the sampler, the decoder."""

import torch

from dreamdrive.prior.vista.condition import embed_action
from dreamdrive.prior.vista.engine import Engine, RoundConditions
from dreamdrive.prior.vista.kinds import SVD, VISTA, ModelKind
from dreamdrive.prior.vista.memory import CHUNK
from dreamdrive.prior.vista.rollout import SCALE, chunks
from dreamdrive.prior.vista.sampler import denoise, guidance
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.gpu.weights import video_model

CHUNKS = (2, 4, 8, CHUNK, 25)
"""Frames that the decoder is given at once."""
SIGMA = 10.0


def size_of(figures: Figures) -> tuple[int, int]:
    """Width and height of the frames."""
    return (64, 64) if figures.pretended else (1024, 576)


@torch.inference_mode()
def measure(figures: Figures) -> None:
    """Vista's three networks, then what differs in SVD: the UNet."""
    engine, latents = _begun(figures, VISTA)
    with figures.attempt("vista conditions"):
        _conditions(figures, engine)
    with figures.attempt("vista step"):
        _step(figures, engine, latents)
    with figures.attempt("vista decoder"):
        _decoder(figures, engine, latents)
    engine.free()
    engine, latents = _begun(figures, SVD)
    with figures.attempt("svd step"):
        _step(figures, engine, latents)
    engine.free()


def _begun(figures: Figures, kind: ModelKind) -> tuple[Engine, torch.Tensor]:
    engine = Engine(video_model(kind, figures.device, tiny=figures.pretended), figures.device)
    width, height = size_of(figures)
    name = kind.name
    figures.put(name, "size", [width, height, engine.per_round])
    weights = {part: own.count / 1e6 for part, own in engine.stored.parts.items()}
    figures.put(name, "millions_of_weights", weights)
    return engine, torch.randn(engine.per_round, 4, height // 8, width // 8, device=figures.device)


def _conditions(figures: Figures, engine: Engine) -> None:
    """The first run makes the weights, too."""
    width, height = size_of(figures)
    images = torch.rand(1, 3, height, width) * 2 - 1
    figures.put("vista", "image encoder, float32", figures.timed(lambda: engine.describe(images)))
    figures.put("vista", "encoder of one frame, float32", figures.timed(lambda: engine.encode(images)))


def _step(figures: Figures, engine: Engine, latents: torch.Tensor) -> None:
    """One step of the sampler: the UNet without and with the conditions."""
    kind, count = engine.stored.kind, len(latents)
    columns = int(engine.stored.parts["image_encoder"].config["projection_dim"])
    action = None if kind is SVD else embed_action({})
    seen = RoundConditions(torch.zeros(columns, device=latents.device), latents[0] / SCALE, action)
    mask = torch.zeros(count, device=latents.device)
    mask[: kind.overlap] = 1
    scale = guidance("constant" if kind.overlap else "linear", count)
    made: list[torch.Tensor] = []

    def step() -> None:
        made[:] = [denoise(engine.velocity(seen), SIGMA * latents, SIGMA, scale, mask)]

    name = f"step, {str(engine.network('unet').dtype)[6:]}"
    figures.put(kind.name, name, figures.timed(step, again=1 if figures.pretended else 3))
    figures.put(kind.name, "finite", bool(torch.isfinite(made[0]).all()))


def _decoder(figures: Figures, engine: Engine, latents: torch.Tensor) -> None:
    """So many frames at once, as the program does it; then in half precision beside float32."""
    count = len(latents)
    engine.network("vae")
    for chunk in CHUNKS:
        if chunk > count:
            continue
        name = f"{chunk} frames at once, float32"
        with figures.attempt(f"decoder: {name}"):
            taken = figures.timed(lambda: engine.decode(latents[:chunk] / SCALE), again=1)  # noqa: B023
            parts = chunks(count, chunk)
            whole = {"clip_s": taken["seconds"] * sum(map(len, parts)) / chunk, "calls": len(parts)}
            figures.put("vista", "decoder", name, taken | whole)
    half = torch.bfloat16 if figures.pretended else torch.float16
    for chunk in (8, CHUNK):
        if chunk > count:
            continue
        name = f"{chunk} frames at once, autocast to {str(half)[6:]}"
        with figures.attempt(f"decoder: {name}"), torch.autocast(figures.device.type, half):
            taken = figures.timed(lambda: engine.decode(latents[:chunk] / SCALE))  # noqa: B023
            figures.put("vista", "decoder", name, taken)
