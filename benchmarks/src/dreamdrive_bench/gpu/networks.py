"""Networks of published sizes: Vista, SVD, MagicDrive and DUSt3R, with random weights."""

from typing import Any

import numpy as np
import torch

from dreamdrive.geometry.backends.dust3r.network import Dust3r, infer
from dreamdrive.geometry.backends.dust3r.network.config import NetworkConfig
from dreamdrive.geometry.backends.dust3r.pairs import make_pairs
from dreamdrive.prior.magicdrive.condition import Conditions
from dreamdrive.prior.magicdrive.config import Settings, read_settings
from dreamdrive.prior.magicdrive.networks import BevControlNet, multiview_unet
from dreamdrive.prior.magicdrive.sample import decode, sample, unipc
from dreamdrive_bench.gpu import video_models
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.gpu.weights import filled

_RING = {str(i): [(i - 1) % 6, (i + 1) % 6] for i in range(6)}
_BOXES = 20
_SCHEDULE = {"beta_start": 0.00085, "beta_end": 0.012, "beta_schedule": "scaled_linear"}


def measure(figures: Figures) -> None:
    """All of them, the largest first."""
    video_models.measure(figures)
    with figures.attempt("magicdrive"):
        _magicdrive(figures, "magicdrive", temporal=False)
    with figures.attempt("dust3r"):
        _dust3r(figures)
    with figures.attempt("magicdrive-t"):
        _magicdrive(figures, "magicdrive-t", temporal=True)


def magicdrive_configs(*, temporal: bool, tiny: bool) -> tuple[dict[str, Any], dict[str, Any]]:
    """Tables of ``unet/`` and ``controlnet/`` for pictures of 400x224."""
    width = 48 if tiny else 768
    base = {
        "block_out_channels": [8, 8, 8, 16] if tiny else [320, 640, 1280, 1280],
        "cross_attention_dim": width,
        "attention_head_dim": 2 if tiny else 8,
        "down_block_types": [*["CrossAttnDownBlock2D"] * 3, "DownBlock2D"],
        "in_channels": 4,
        "layers_per_block": 2,
        "norm_num_groups": 4 if tiny else 32,
    }
    unet = base | {"neighboring_view_pair": _RING, "img_size": [224, 400]}
    unet |= {"up_block_types": ["UpBlock2D", *["CrossAttnUpBlock2D"] * 3]}
    if temporal:
        unet |= {"temp_attn_type": "_s_ff_t_last", "zero_module_type2": "none", "video_length": 16}
    boxes = {"n_classes": 10, "class_token_dim": width, "embedder_num_freq": 4, "mode": "all-xyz"}
    boxes |= {"proj_dims": [width, width, width, width], "minmax_normalize": False}
    control = base | {
        "map_embedder_cls": None,
        "map_embedder_param": None,
        "map_size": [8, 200, 200],
        "conditioning_embedding_out_channels": [8] * 4 if tiny else [16, 32, 96, 256],
        "cam_embedder_param": {
            "input_dims": 3,
            "num_freqs": 4,
            "include_input": True,
            "log_sampling": True,
        },
        "bbox_embedder_param": boxes,
    }
    if tiny:
        unet |= {"img_size": [24, 44]}
        control |= {"map_embedder_cls": "BEVControlNetConditioningEmbeddingPlus"}
        control["map_embedder_param"] = {
            "conditioning_embedding_size": [3, 5],
            "conditioning_size": [8, 40, 40],
            "block_out_channels": [8, 8, 8, 8],
        }
    return unet, control


def _conditions(settings: Settings, width: int, device: torch.device) -> Conditions:
    steps, views = settings.frames, settings.views
    return Conditions(
        raster=torch.rand(steps, *settings.map_shape, device=device).round(),
        cameras=torch.randn(steps, views, 3, 7, device=device),
        corners_m=10 * torch.randn(steps, views, _BOXES, 8, 3, device=device),
        classes=torch.zeros(steps, views, _BOXES, dtype=torch.int64, device=device),
        present=torch.ones(steps, views, _BOXES, dtype=torch.bool, device=device),
        text=torch.randn(steps, 77, width, device=device),
    )


def _magicdrive(figures: Figures, name: str, temporal: bool) -> None:
    """Steps of the sampler and the decoder, for all cameras of what is sampled together."""
    from diffusers.models.autoencoders.autoencoder_kl import AutoencoderKL

    device, tiny = figures.device, figures.pretended
    dtype = torch.float16 if device.type == "cuda" else torch.float32
    configs = magicdrive_configs(temporal=temporal, tiny=tiny)
    settings = read_settings(*configs)
    unet = filled(lambda: multiview_unet(configs[0], settings), device, dtype)
    control = filled(lambda: BevControlNet(configs[1], settings), device, dtype)
    pictures = settings.frames * settings.views
    figures.put(name, "size", [*settings.size, pictures])
    seen = _conditions(settings, int(configs[0]["cross_attention_dim"]), device)
    branches = seen, seen.without(control.null_camera, torch.zeros_like(seen.text))
    noise = torch.randn(pictures, 4, settings.size[1] // 8, settings.size[0] // 8, device=device)
    steps = 1 if tiny else 4

    def sampled() -> None:
        sample(unet, control, branches, noise, unipc(_SCHEDULE, steps, device))

    taken = figures.timed(sampled, again=0 if tiny else 1)
    taken["step_s"] = taken.get("seconds", taken["first_s"]) / steps
    figures.put(name, f"sampling, {str(dtype)[6:]}", taken | {"steps": steps})
    del unet, control
    level = 8 if tiny else 128
    widths = (level, level, level, level) if tiny else (128, 256, 512, 512)
    blocks = {f"{way.lower()}_block_types": (f"{way}{kind}Block2D",) * 4 for way, kind in _WAYS}
    groups = 4 if tiny else 32
    vae = filled(
        lambda: AutoencoderKL(
            block_out_channels=widths, norm_num_groups=groups, layers_per_block=2, **blocks
        ),
        device,
        dtype,
    )
    figures.put(name, "decoder", figures.timed(lambda: decode(vae, noise), again=0 if tiny else 1))


_WAYS = (("Down", "Encoder"), ("Up", "Decoder"))


def _dust3r(figures: Figures) -> None:
    """Pairs of frames of 512x288, in batches as the program makes them; its trunk in bfloat16 on a GPU."""
    tiny = figures.pretended
    config = NetworkConfig()
    if tiny:
        config = NetworkConfig(
            enc_dim=16, enc_depth=1, enc_heads=2, dec_dim=16, dec_depth=1, dec_heads=2, head="linear"
        )
    network = filled(lambda: Dust3r(config), figures.device)
    if figures.device.type == "cuda":
        network.lower_trunk()
    size = (32, 64) if tiny else (288, 512)
    frames = 3 if tiny else 24
    random = np.random.default_rng(0)
    pictures = [random.integers(0, 255, (*size, 3), dtype=np.uint8) for _ in range(frames)]
    edges = make_pairs(frames)
    taken = figures.timed(lambda: infer(network, pictures, edges), again=1)
    taken |= {"frames": frames, "pairs": len(edges), "pair_s": taken["seconds"] / len(edges)}
    figures.put("dust3r", f"{size[1]}x{size[0]}", taken)
