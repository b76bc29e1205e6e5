"""The part of Vista of a second set."""

import itertools
from pathlib import Path

import numpy as np
import torch
from diffusers.models.embeddings import Timesteps
from torch import Tensor

from dreamdrive.prior.early_features import watch
from dreamdrive.prior.vista.condition import NUMBERS, clip_pixels, embed_action
from dreamdrive.prior.vista.keys import PARTS, UNET, recipes_of
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.rollout import SCALE, decode_in_chunks, roll_out
from dreamdrive.prior.vista.sampler import Branches, denoise, guidance, sample, sigmas
from tests.golden import reading
from tests.golden.cut import write
from tests.prior.vista import tiny
from tests.prior.vista.networks import build, golden_unet
from tests.prior.vista.test_condition import KINDS
from tests.prior.vista.test_keys import MAPS, as_table
from tests.prior.vista.test_rollout import STEPS, stand_in
from tests.prior.vista.test_sampler import TINY_STEPS, mask_of, tiny_velocity
from tests.prior.vista.test_unet import place_of, predict

Tensors = dict[str, Tensor]
PER_LEVEL = 2
_PICTURES = [(16, 8), (8, 24), (12, 20)]
"""Heights and widths of latents, which the UNet halves twice."""


def make(to: Path, rng: np.random.Generator) -> None:
    """Write all files."""
    tiny.IMAGE = int(rng.choice([24, 40, 56]))
    tiny.states.cache_clear()
    official = tiny.official(VISTA, seed=int(rng.integers(1000)))
    _names(to, official)
    unet = {k.removeprefix(UNET): v.half() for k, v in official.items() if k.startswith(UNET)}
    _save(to, "tiny_unet_state_fp16", unet)
    config = {"num_head_channels": int(rng.choice([8, 32])), "num_res_blocks": PER_LEVEL}
    write(to / "vista/tiny_unet_config.json", config | {"context_dim": tiny.IMAGE})
    _save(to, "unet_forward", _unet_forward(rng))
    _save(to, "conditioning", _conditioning(rng))
    _save(to, "sampler", _sampler(rng))
    _save(to, "sampler_tiny_unet", _sampler_tiny_unet(rng))
    _save(to, "rollout_standin", _rollout(rng))
    image = (2 * torch.rand(1, 3, *rng.integers(100, 300, 2).tolist()) - 1).half()
    stride = int(rng.integers(3, 7))
    small = clip_pixels(image.float())[..., ::stride, ::stride]
    _save(
        to,
        "clip_preprocess",
        {"image_fp16": image, "clip_input": small, "note_stride": torch.tensor([stride])},
    )
    _vae(to, official, rng)


def _save(to: Path, name: str, tensors: Tensors) -> None:
    arrays = {key: value.detach().numpy() for key, value in tensors.items()}
    write(to / f"vista/{name}.safetensors", arrays)


def _names(to: Path, official: Tensors) -> None:
    recipes = recipes_of(official)
    write(to / "vista/vista_checkpoint_keys.json", {k: list(v.shape) for k, v in official.items()})
    for part in PARTS:
        write(to / f"vista/map_{MAPS[part]}.json", as_table(recipes, part))


def _context(count: int, tokens: int) -> Tensor:
    width = reading.tensors("vista/tiny_unet_state_fp16.safetensors")
    columns = next(v.shape[1] for k, v in width.items() if "k_adapter_action_control" in k)
    return torch.randn(count, tokens, tiny.IMAGE + columns)


def _unet_forward(rng: np.random.Generator) -> Tensors:
    clips, frames = int(rng.integers(1, 4)), int(rng.integers(3, 7))
    total = clips * frames
    mask = torch.zeros(clips, frames)
    for clip in range(clips):
        mask[clip, : clip + 1] = 1
    given = reading.Table(
        {
            "in.num_frames": torch.tensor([frames]),
            "in.x": torch.randn(total, 8, *_PICTURES[int(rng.integers(3))]),
            "in.timesteps": torch.randn(clips).repeat_interleave(frames),
            "in.y": torch.randn(clips, 96).repeat_interleave(frames, dim=0),
            "in.cond_mask": mask.flatten(),
            "in.context_1tok": _context(clips, 1),
            "in.context_4tok": _context(clips, 4),
        }
    )
    unet, plain, made = golden_unet(), golden_unet(actions=False), dict[str, Tensor]()
    for tokens, masked in itertools.product(("1tok", "4tok"), (True, False)):
        context, name = given[f"in.context_{tokens}"], f"{tokens}_{'mask' if masked else 'nomask'}"
        made[f"out_{name}"] = predict(unet, given, context, mask=masked)
        image = context[..., : tiny.IMAGE]
        made[f"out_{name}_noaction"] = predict(plain, given, image, mask=masked)
        made[f"out_{name}_zeroaction"] = made[f"out_{name}_noaction"]
    blocks = [f"input_blocks.{i}" for i in (0, 1, 3, 4, 8)] + [f"output_blocks.{i}" for i in (0, 2, 4, 8)]
    for name in (*blocks, "middle_block"):
        kept: list[Tensor] = []
        handle = watch(unet, place_of(name, PER_LEVEL), kept.append)
        predict(unet, given, given["in.context_1tok"], mask=True)
        handle.remove()
        made[f"feat.{name}"] = torch.cat(kept)
    return {**given, **{f"out.{key}": value.clone() for key, value in made.items()}}


def _conditioning(rng: np.random.Generator) -> Tensors:
    numbers = {kind: 3 * torch.rand(1, count) for kind, count in NUMBERS.items()}
    numbers["command"] = torch.tensor([2])
    ids = torch.tensor([rng.integers(3, 30), rng.integers(20, 200), 0.25]).float()
    width = int(rng.choice([32, 64]))
    vector = Timesteps(width, flip_sin_to_cos=True, downscale_freq_shift=0)(ids).flatten()[None]
    image, latent = torch.randn(1, 1, int(rng.choice([40, 100]))), torch.randn(1, 4, 3, 5)
    found = {f"in.{kind}": value for kind, value in numbers.items()}
    found |= {"in.fps_id": ids[:1].long(), "in.motion_bucket_id": ids[1:2].long(), "in.cond_aug": ids[2:]}
    found |= {"in.cond_frames": latent, "in.cond_frames_without_noise": image}
    for name, kinds in KINDS.items():
        columns = embed_action({kind: numbers[kind].flatten().tolist() for kind in kinds})
        context = torch.cat([image.flatten(), columns])[None, None]
        found |= {f"{name}.c.crossattn": context, f"{name}.c.vector": vector, f"{name}.c.concat": latent}
    for part in ("crossattn", "concat"):
        found[f"all.uc.{part}"] = torch.zeros_like(found[f"all.c.{part}"])
    found["all.uc.vector"] = vector
    return {key: value.clone() for key, value in found.items()}


def _sampler(rng: np.random.Generator) -> Tensors:
    frames, steps, c = int(rng.integers(5, 12)), int(rng.integers(3, 8)), 4
    shape = (frames, c, *map(int, rng.integers(2, 6, 2)))
    found = {"lin_A": torch.randn(c, c) / c, "ctx": torch.randn(frames, c)}
    found |= {"noise": torch.randn(shape), "cond_frame": torch.randn(shape)}
    for count in (steps, steps + 9):
        found[f"sigmas_{count}"] = torch.tensor(sigmas(count))
    for count in (frames, frames + 4):
        found[f"linear_scale_{count}"] = torch.linspace(1, 2.2, count)[None]
        found[f"triangle_scale_{count}"] = guidance("triangle", count)[None]
    scales = {
        "VanillaCFG": guidance("constant", frames),
        "TrianglePredictionGuider": guidance("triangle", frames),
        "LinearPredictionGuider": found[f"linear_scale_{frames}"][0],
    }
    for (guider, scale), known in itertools.product(scales.items(), ("none", "c0", "c01", "c0123")):
        entered: list[Tensor] = []

        def velocity(x: Tensor, time: float, fixed: Tensor, entered: list[Tensor] = entered) -> Branches:
            entered.append(x)
            plain = torch.einsum("oc,bchw->bohw", found["lin_A"], x) + 0.05 * time
            plain = plain + 0.1 * fixed[:, None, None, None]
            return plain, plain + 0.2 * found["ctx"][:, :, None, None]

        mask, clean = mask_of(known, frames), found["cond_frame"]
        found[f"{guider}.{known}.out"] = sample(velocity, found["noise"], scale, mask, clean, steps)
        inputs = [x * (s**2 + 1) ** 0.5 for x, s in zip(entered, sigmas(steps), strict=False)]
        found[f"{guider}.{known}.x_in"] = torch.stack(inputs)
    return found


def _sampler_tiny_unet(rng: np.random.Generator) -> Tensors:
    frames, size = int(rng.integers(3, 9)), _PICTURES[int(rng.integers(3))]
    given = reading.Table({name: torch.randn(frames, 4, *size) for name in ("noise", "cond_frame")})
    given["concat"], given["vector"] = torch.randn(1, 4, *size), torch.randn(1, 96)
    given["crossattn"] = _context(1, 1)
    noisy = given["denoise_sigma5_in"] = 5 * torch.randn(frames, 4, *size)
    velocity = tiny_velocity(given)
    made = {
        "denoise_sigma5_out": denoise(velocity, noisy, 5.0, torch.ones(frames), mask_of("c0", frames)),
    }
    for name, schedule in (("vanilla_c01", "constant"), ("triangle_c0", "triangle")):
        mask, scale = mask_of(name, frames), guidance(schedule, frames)  # type: ignore[arg-type]
        made[f"out.{name}"] = sample(velocity, given["noise"], scale, mask, given["cond_frame"], TINY_STEPS)
    return {**given, **made}


def _rollout(rng: np.random.Generator) -> Tensors:
    frames, c = int(rng.integers(6, 22)), int(rng.choice([3, 5]))
    height, width = rng.integers(2, 5, 2).tolist()
    given = reading.Table({"enc": torch.randn(c, 3), "dec": torch.randn(3, c) / 2})
    given |= {"net": torch.randn(c, 2 * c) / 5, "images": 2 * torch.rand(4, 3, 2 * height, 2 * width) - 1}
    given = reading.Table(given)
    found = dict(given)
    for rounds in (1, 2):
        described: list[Tensor] = []
        model, noise = stand_in(given, described), torch.randn(rounds, frames, c, height, width)
        made = roll_out(model, VISTA, given["images"][:1], noise, [None] * rounds, STEPS)
        decoded = (decode_in_chunks(model.decode, made / SCALE) + 1) / 2
        found |= {f"r{rounds}.noise": noise, f"r{rounds}.latents": made}
        found |= {f"r{rounds}.frames": decoded.clamp(0, 1), f"r{rounds}.cond_img": torch.cat(described)}
    for count in (9, 31):
        latents = torch.randn(count, c, height, width)
        decoded = decode_in_chunks(stand_in(given, []).decode, latents / SCALE)
        found |= {f"decode_in_{count}": latents, f"decode_out_{count}": decoded}
    return found


def _vae(to: Path, official: Tensors, rng: np.random.Generator) -> None:
    ours = ("conditioner.embedders.3.", "first_stage_model.decoder.")
    state = {key: value.half() for key, value in official.items() if key.startswith(ours)}
    vae = build("vae", {key: value.float() for key, value in state.items()})
    frames, size = int(rng.integers(2, 6)), [8 * int(side) for side in rng.integers(1, 4, 2)]
    image, z = 2 * torch.rand(3, 3, *size) - 1, torch.randn(frames, 4, size[0] // 8, size[1] // 8)
    coded = vae.encode(image).latent_dist
    found = {"image": image, "z": z, "moments": coded.parameters, "mode": coded.mode()}
    found["frames"] = vae.decode(z, num_frames=frames).sample
    _save(to, "tiny_vae_state_fp16", state)
    _save(to, "vae", found)
