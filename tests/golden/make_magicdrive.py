"""The part of MagicDrive of a second set."""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from diffusers.models.attention import BasicTransformerBlock
from torch import Tensor

from dreamdrive.prior.magicdrive.blocks import TemporalBlock
from dreamdrive.prior.magicdrive.condition import Conditions, box_corners
from dreamdrive.prior.magicdrive.config import Temporal, parse_settings, read_settings
from dreamdrive.prior.magicdrive.networks import BevControlNet, MapEncoder, fourier, multiview_unet
from dreamdrive.prior.magicdrive.sample import sample, unipc
from dreamdrive.scene.level import upright
from tests.golden.cut import write
from tests.prior.magicdrive.test_networks import one_pass, tokens
from tests.prior.magicdrive.tiny import official_configs, tiny_configs

SCHEDULER = {"num_train_timesteps": 1000, "beta_start": 0.00085, "beta_end": 0.012}
Networks = tuple[Any, BevControlNet]


def make(to: Path, rng: np.random.Generator) -> None:
    """Write all files."""
    configs = _configs(rng)
    settings = parse_settings(configs["unet"], configs["controlnet"])
    networks = multiview_unet(configs["unet"], settings), BevControlNet(configs["controlnet"], settings)
    state: dict[str, Tensor] = {}
    for name, network in zip(("unet", "controlnet"), networks, strict=True):
        network.load_state_dict({k: _random(k, v).half().float() for k, v in network.state_dict().items()})
        network.eval().requires_grad_(False)
        state |= {f"{name}.{k}": v.half() for k, v in network.state_dict().items()}
    write(to / "magicdrive/tiny_config.json", configs)
    write(to / "magicdrive/tiny_state_fp16.safetensors", _arrays(state))
    write(to / "magicdrive/forward.safetensors", _arrays(_forward(networks, configs, rng)))
    _scheduler(to, configs["scheduler"], rng)
    _blocks(to, rng)
    unet, controlnet = official_configs()
    official = read_settings(unet, controlnet)
    with torch.device("meta"):
        parts = {"unet": multiview_unet(unet, official), "controlnet": BevControlNet(controlnet, official)}
    keys = {name: {k: list(v.shape) for k, v in part.state_dict().items()} for name, part in parts.items()}
    write(to / "magicdrive/magicdrive_checkpoint_keys.json", keys)


def _arrays(tensors: dict[str, Tensor]) -> dict[str, np.ndarray]:
    return {key: value.detach().numpy() for key, value in tensors.items()}


def _random(name: str, value: Tensor) -> Tensor:
    """Matrices that keep the size of what goes through them; cameras and corners come in metres."""
    if not value.is_floating_point():
        return value
    drawn = torch.randn_like(value)
    if value.ndim < 2:
        return 0.1 * drawn + (1.0 if "norm" in name and name.endswith("weight") else 0.0)
    small = 0.1 if any(part in name for part in ("cam2token", "bbox_proj")) else 1.0
    return small * drawn / max(value[0].numel(), 1) ** 0.5


def _configs(rng: np.random.Generator) -> dict[str, Any]:
    """Networks for another ring of cameras, an oblong map and another number of its channels and classes."""
    unet, controlnet = tiny_configs()
    views, width = int(rng.integers(3, 6)), int(rng.choice([24, 40]))
    ring = {str(i): [(i - 1) % views, (i + 1) % views] for i in range(views)}
    both = {"cross_attention_dim": width, "attention_head_dim": int(rng.choice([1, 4]))}
    boxes = controlnet["bbox_embedder_param"]
    boxes |= {"n_classes": int(rng.integers(3, 9)), "class_token_dim": width, "proj_dims": [16, 24, 8, width]}
    channels, *cells = (
        int(rng.integers(3, 7)),
        *map(int, rng.choice(np.arange(36, 70, 2), 2, replace=False)),
    )
    widths = [8, 8, 16, 16]
    controlnet |= both | {"map_embedder_cls": None, "map_embedder_param": None}
    controlnet |= {"map_size": [channels, *cells], "conditioning_embedding_out_channels": widths}
    height, wide = MapEncoder(channels, tuple(widths), 8)(torch.zeros(1, channels, *cells)).shape[2:]
    unet |= both | {"neighboring_view_pair": ring, "img_size": [8 * height, 8 * wide]}
    return {"unet": unet, "controlnet": controlnet, "scheduler": SCHEDULER | {"beta_schedule": "linear"}}


def _forward(networks: Networks, configs: dict[str, Any], rng: np.random.Generator) -> dict[str, Tensor]:
    unet, controlnet = networks
    b, k, n = int(rng.integers(1, 4)), int(rng.integers(2, 6)), len(configs["unet"]["neighboring_view_pair"])
    width, classes = configs["unet"]["cross_attention_dim"], configs["controlnet"]["bbox_embedder_param"]
    height, wide = (side // 8 for side in configs["unet"]["img_size"])
    boxes = np.concatenate(
        [
            rng.uniform(-20, 20, (b, n, k, 3)),
            rng.uniform(1, 4, (b, n, k, 3)),
            rng.uniform(-3, 3, (b, n, k, 1)),
        ],
        axis=-1,
    ).astype(np.float32)
    flat = boxes.reshape(-1, 7).astype(np.float64)
    poses = np.stack([upright(np.array([x, y, -yaw - np.pi / 2])) for x, y, *_, yaw in flat])
    poses[:, 2, 3] = flat[:, 2]
    corners = torch.from_numpy(box_corners(poses, flat[:, [4, 3, 5]])).float().reshape(b, n, k, 8, 3)
    c = Conditions(
        (torch.randn(b, *configs["controlnet"]["map_size"]) > 0.5).float(),
        torch.randn(b, n, 3, 7),
        corners,
        torch.randint(classes["n_classes"], (b, n, k)),
        torch.rand(b, n, k) > 0.4,
        torch.randn(b, 5, width),
    )
    given = {"neg_text": torch.randn(b, 5, width), "latents": torch.randn(b, n, 4, height, wide)}
    given |= {"timesteps": torch.randint(1000, (b,)), "pipe_latents0": torch.randn(b, 4, height, wide)}
    given |= {"boxes_xyzwlhyaw": torch.from_numpy(boxes), "boxes_corners_all": corners, "bev_map": c.raster}
    given |= {"camera_param": c.cameras, "bboxes": c.corners_m, "classes": c.classes, "text": c.text}
    given["masks"] = c.present.to(torch.uint8)
    noise, plain = one_pass(networks, c, given["latents"], given["timesteps"])
    times = given["timesteps"].repeat_interleave(n)
    down, middle = controlnet.residuals(
        given["latents"].flatten(0, 1), times, tokens(controlnet, c), c.raster
    )
    bare = Conditions(
        c.raster, c.cameras, c.corners_m[:, :, :0], c.classes[:, :, :0], c.present[:, :, :0], c.text
    )
    made = {
        "cam_fourier": fourier(c.cameras.transpose(-1, -2)).flatten(-2),
        "fourier_points": fourier(c.corners_m),
        "cam_token": controlnet.camera_tokens(c.cameras),
        "bbox_tokens": controlnet.bbox_embedder(c.corners_m, c.classes, c.present),
        "map_feat": controlnet.controlnet_cond_embedding(c.raster),
        "uncond_cam": controlnet.null_camera[None, None],
        "ehs": tokens(controlnet, c),
        "nobox_ehs": tokens(controlnet, bare),
        "uncond_camera_param": controlnet.null_camera.expand_as(c.cameras).clone(),
        "unet": noise,
        "unet_noresidual": plain,
        "cn_mid": middle,
        **{f"cn_down.{i}": residual for i, residual in enumerate(down)},
    }
    steps = int(rng.integers(2, 5))
    made["pipe_timesteps"] = unipc(configs["scheduler"], steps).timesteps
    for name, zero_map in (("zeromap", True), ("samemap", False)):
        free = c.without(controlnet.null_camera, given["neg_text"], zero_map=zero_map)
        latents = given["pipe_latents0"].repeat_interleave(n, dim=0)
        run = sample(unet, controlnet, (c, free), latents, unipc(configs["scheduler"], steps))
        made[f"pipe_{name}"] = run.unflatten(0, (b, n))
    return {f"in.{k}": v for k, v in given.items()} | {f"out.{k}": v for k, v in made.items()}


def _scheduler(to: Path, table: dict[str, Any], rng: np.random.Generator) -> None:
    start = torch.randn(1, 3, 4, 7)
    found = {"x0": start}
    for steps in rng.choice(np.arange(3, 30), 2, replace=False).tolist():
        scheduler = unipc(table, steps)
        trace = [start]
        for time in scheduler.timesteps:
            step: Any = scheduler.step(0.9 * trace[-1] + 0.0005 * time, time, trace[-1], return_dict=False)
            trace.append(step[0])
        found |= {f"timesteps_{steps}": scheduler.timesteps, f"trace_{steps}": torch.stack(trace)}
    write(to / "magicdrive/unipc_scheduler.safetensors", _arrays(found))


def _blocks(to: Path, rng: np.random.Generator) -> None:
    heads, dim_head, frames = (int(rng.choice(sizes)) for sizes in ([1, 3], [8, 16], [4, 7]))
    cams, batch, cross = (int(rng.choice(sizes)) for sizes in ([4, 5], [1, 3], [20, 36]))
    about = {"dim": heads * dim_head, "heads": heads, "dim_head": dim_head, "video_length": frames}
    about |= {"cross_attention_dim": cross, "batch": batch, "cams": cams}
    about["sc_attn_index"] = rng.integers(0, frames, (frames, 4)).tolist()
    found: dict[str, Tensor] = {}
    for kind, connector, positions in (("s_ff_t_last", False, True), ("t_last", True, False)):
        plain = BasicTransformerBlock(about["dim"], heads, dim_head, cross_attention_dim=cross)
        block = TemporalBlock(plain, cams, Temporal(frames, False, connector, positions))
        block.load_state_dict({k: _random(k, v) for k, v in block.state_dict().items()})
        if kind.startswith("s_ff"):
            block.sources = about["sc_attn_index"]
        x, words = (
            torch.randn(batch * frames * cams, 5, about["dim"]),
            torch.randn(batch * frames * cams, 4, cross),
        )
        found |= {f"{kind}.state.{k}": v for k, v in block.state_dict().items()}
        found |= {f"{kind}.in.x": x, f"{kind}.in.ehs": words}
        found[f"{kind}.out"] = block(x, encoder_hidden_states=words)
    write(to / "magicdrive/temporal_block.json", about)
    write(to / "magicdrive/temporal_block.safetensors", _arrays(found))
