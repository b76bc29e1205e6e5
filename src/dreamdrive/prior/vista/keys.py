"""Rules from the names in the official single files to those of diffusers and transformers.

The files are ``vista.safetensors`` (Gao et al., NeurIPS 2024) and ``svd_xt.safetensors`` (Blattmann et al.,
2023).
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import torch
from torch import Tensor

Part = Literal["unet", "vae", "image_encoder"]
PARTS: tuple[Part, ...] = ("unet", "vae", "image_encoder")
UNET = "model.diffusion_model."
_VISUAL = "conditioner.embedders.0.open_clip.model.visual."
_CONDITION = "conditioner.embedders.3.encoder."
_DECODER = "first_stage_model.decoder."

IGNORED = {
    "the text half of CLIP": re.compile(r"conditioner\.embedders\.0\.open_clip\.model\.(?!visual\.)"),
    "a second decoder": re.compile(r"conditioner\.embedders\.3\.encoder\.(decoder|post_quant_conv)\."),
    "a second encoder": re.compile(r"first_stage_model\.encoder\."),
}
"""What the files hold and nothing here needs."""


@dataclass(frozen=True)
class Recipe:
    """How one tensor of a network is made of those in the file, by their keys.

    The product of the ``low_rank`` tensors U and D is added (LoRA of rank r, scale 1), a third of the rows is
    taken, the weight of a 1x1 convolution becomes the matrix that it is, and ``columns`` are put beside it.
    """

    source: str
    columns: str | None = None
    third: int | None = None
    transposed: bool = False
    flat: bool = False
    low_rank: tuple[str, str] | None = None

    def make(self, get: Callable[[str], Tensor]) -> Tensor:
        """The tensor; ``get`` reads one of the file by its key."""
        value = get(self.source)
        if self.low_rank is not None:
            up, down = (get(key).float() for key in self.low_rank)
            value = (value.float() + up @ down).to(value.dtype)
        if self.third is not None:
            value = value.chunk(3)[self.third]
        if self.flat and value.ndim > 2:
            value = value[..., 0, 0]
        if self.columns is not None:
            value = torch.cat([value, get(self.columns)], dim=1)
        return value.T.contiguous() if self.transposed else value


@dataclass
class Recipes:
    """What a file gives: the recipe of each tensor by part and name.

    Beside them keys of no use, keys that no rule knows, and those of the action adapters.
    """

    parts: dict[Part, dict[str, Recipe]] = field(default_factory=lambda: {part: {} for part in PARTS})
    ignored: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    actions: list[str] = field(default_factory=list)

    def shapes(self, part: Part, stored: Mapping[str, tuple[int, ...]]) -> dict[str, tuple[int, ...]]:
        """Shapes of a part's tensors, from those of the file's."""
        get = {key: torch.empty(shape, device="meta") for key, shape in stored.items()}.__getitem__
        return {name: tuple(recipe.make(get).shape) for name, recipe in self.parts[part].items()}


def recipes_of(keys: Iterable[str]) -> Recipes:
    """The recipes for a file that holds these keys."""
    keys = sorted(keys)
    found, joined = Recipes(), list[str]()
    # Residual blocks a level of the UNet: the first down-sampling comes right behind them.
    per_level = _counted(min, UNET + r"input_blocks\.(\d+)\.0\.op\.", keys) - 1
    top = _counted(max, _DECODER + r"up\.(\d+)\.", keys)
    for key in keys:
        if any(pattern.match(key) for pattern in IGNORED.values()):
            found.ignored.append(key)
        elif _ADDED.search(key):
            joined.append(key)
        else:
            part, made = _translate(key, per_level, top)
            if not made:
                found.unknown.append(key)
            found.parts[part].update(made)
    for key in joined:
        _join(found, key, per_level, set(keys))
    return found


_ADDED = re.compile(r"(.*\.attn\d)\.(q|k|v|out)_adapter_(action_control|up|down)\.weight")
_RESIDUAL = {
    "in_layers.0": "norm1",
    "in_layers.2": "conv1",
    "emb_layers.1": "time_emb_proj",
    "out_layers.0": "norm2",
    "out_layers.3": "conv2",
    "skip_connection": "conv_shortcut",
}
_PLAIN = {name: name for name in _RESIDUAL.values()} | {"nin_shortcut": "conv_shortcut"}
"""Names in the autoencoder's residual blocks, but for the part over time."""
_ATTENTION = {"norm": "group_norm", "q": "to_q", "k": "to_k", "v": "to_v", "proj_out": "to_out.0"}
_EMBEDDINGS = {
    "time_embed.0": "time_embedding.linear_1",
    "time_embed.2": "time_embedding.linear_2",
    "label_emb.0.0": "add_embedding.linear_1",
    "label_emb.0.2": "add_embedding.linear_2",
    "cond_time_stack_embed.0": "cond_time_embedding.linear_1",
    "cond_time_stack_embed.2": "cond_time_embedding.linear_2",
    "input_blocks.0.0": "conv_in",
    "out.0": "conv_norm_out",
    "out.2": "conv_out",
}
_TIME = {"time_pos_embed.0": "time_pos_embed.linear_1", "time_pos_embed.2": "time_pos_embed.linear_2"}
_VISUAL_NAMES = {
    "class_embedding": "vision_model.embeddings.class_embedding",
    "conv1.weight": "vision_model.embeddings.patch_embedding.weight",
    "positional_embedding": "vision_model.embeddings.position_embedding.weight",
    "ln_pre.weight": "vision_model.pre_layrnorm.weight",  # the library's spelling
    "ln_pre.bias": "vision_model.pre_layrnorm.bias",
    "ln_post.weight": "vision_model.post_layernorm.weight",
    "ln_post.bias": "vision_model.post_layernorm.bias",
}
_VISUAL_LAYER = {
    "ln_1": "layer_norm1",
    "ln_2": "layer_norm2",
    "mlp.c_fc": "mlp.fc1",
    "mlp.c_proj": "mlp.fc2",
    "attn.out_proj": "self_attn.out_proj",
}


def _counted(pick: Callable[..., int], pattern: str, keys: list[str]) -> int:
    found = (re.match(pattern, key) for key in keys)
    return pick((int(match[1]) for match in found if match), default=3)


def _translate(key: str, per_level: int, top: int) -> tuple[Part, dict[str, Recipe]]:
    """Which part a key belongs to, and what it makes there; nothing where no rule knows it."""
    if key.startswith(_VISUAL):
        return "image_encoder", _visual(key)
    if key.startswith((_CONDITION, _DECODER)):
        name = _autoencoder(key, top)
        return "vae", {} if name is None else {name: Recipe(key, flat=".mid.attn_1." in key)}
    name = _unet(key.removeprefix(UNET), per_level) if key.startswith(UNET) else None
    return "unet", {} if name is None else {name: Recipe(key)}


def _unet(name: str, per_level: int) -> str | None:
    if (stem := _swap(name, _EMBEDDINGS)) is not None:
        return stem
    match = re.match(r"(?:(in|out)put_blocks\.(\d+)|middle_block)\.(\d+)\.(.*)", name)
    if match is None:
        return None
    side, index, which, rest = match.groups()
    if side is None:
        place, block, attends = "mid_block", int(which) // 2, which == "1"
    else:
        level, block = divmod(int(index) - (side == "in"), per_level + 1)
        place, attends = f"{'down' if side == 'in' else 'up'}_blocks.{level}", which != "0"
        if rest.startswith("op."):
            return f"{place}.downsamplers.0.conv.{rest.removeprefix('op.')}"
        if rest.startswith("conv."):
            return f"{place}.upsamplers.0.{rest}"
    if attends:
        inner = _swap(rest, _TIME) or re.sub(r"^time_stack\.", "temporal_transformer_blocks.", rest)
        return f"{place}.attentions.{block}.{inner}"
    return _residual(f"{place}.resnets.{block}.", rest, _RESIDUAL)


def _residual(place: str, rest: str, names: dict[str, str]) -> str | None:
    """Inside a residual block that has a part over time."""
    if rest.removeprefix("time_mixer.") == "mix_factor":
        return f"{place}time_mixer.mix_factor"
    if rest.startswith("time_stack."):
        return _swap(rest.removeprefix("time_stack."), _RESIDUAL, f"{place}temporal_res_block.")
    return _swap(rest, names, f"{place}spatial_res_block.")


def _swap(name: str, names: dict[str, str], place: str = "") -> str | None:
    """The name at its place with its stem replaced; None where the stem is not among them."""
    stem, _, kind = name.rpartition(".")
    return f"{place}{names[stem]}.{kind}" if stem in names else None


def _autoencoder(key: str, top: int) -> str | None:
    if key.startswith(_DECODER):
        half, name = "decoder", key.removeprefix(_DECODER)
    else:
        half, _, name = key.removeprefix(_CONDITION).partition(".")
    if half == "quant_conv":
        return f"quant_conv.{name}"
    if name.startswith("mid.attn_1."):
        return _swap(name.removeprefix("mid.attn_1."), _ATTENTION, f"{half}.mid_block.attentions.0.")
    name = name.replace("conv_out.time_mix_conv.", "time_conv_out.")
    if match := re.match(r"(down|up|mid)\.(?:(\d+)\.block\.|block_)(\d+)\.(.*)", name):
        side, level, block, rest = match.groups()
        place = "mid_block" if level is None else f"{side}_blocks.{_level(side, level, top)}"
        place = f"{half}.{place}.resnets.{int(block) - (level is None)}."
        # Only the decoder's blocks have a part over time.
        return _swap(rest, _PLAIN, place) if half == "encoder" else _residual(place, rest, _PLAIN)
    if match := re.match(r"(down|up)\.(\d+)\.(down|up)sample\.(conv\..*)", name):
        side, level, _, rest = match.groups()
        return f"{half}.{side}_blocks.{_level(side, level, top)}.{side}samplers.0.{rest}"
    return f"{half}.{re.sub('^norm_out', 'conv_norm_out', name)}"


def _level(side: str, level: str, top: int) -> int:
    """Counted in the order of the work, which in the decoder begins with the highest."""
    return top - int(level) if side == "up" else int(level)


def _visual(key: str) -> dict[str, Recipe]:
    name = key.removeprefix(_VISUAL)
    if name in _VISUAL_NAMES:
        return {_VISUAL_NAMES[name]: Recipe(key)}
    if name == "proj":
        return {"visual_projection.weight": Recipe(key, transposed=True)}
    match = re.match(r"transformer\.resblocks\.(\d+)\.(.*)", name)
    if match is None:
        return {}
    place, rest = f"vision_model.encoder.layers.{match[1]}", match[2]
    if rest.startswith("attn.in_proj_"):
        kind = rest.removeprefix("attn.in_proj_")
        return {
            f"{place}.self_attn.{which}_proj.{kind}": Recipe(key, third=i) for i, which in enumerate("qkv")
        }
    name = _swap(rest, _VISUAL_LAYER, f"{place}.")
    return {} if name is None else {name: Recipe(key)}


def _join(found: Recipes, key: str, per_level: int, keys: set[str]) -> None:
    """Add the columns of the actions, or LoRA that is not merged yet, to the matrix that they belong to."""
    match, unet = _ADDED.fullmatch(key), found.parts["unet"]
    if match is not None and key.startswith(UNET):
        to = "to_out.0" if match[2] == "out" else f"to_{match[2]}"
        name = _unet(f"{match[1]}.{to}.weight".removeprefix(UNET), per_level)
        up, down = (f"{match[1]}.{match[2]}_adapter_{which}.weight" for which in ("up", "down"))
        if name in unet and match[3] == "action_control":
            found.actions.append(key)
            unet[name] = replace(unet[name], columns=key)
            return
        if name in unet and up in keys and down in keys:
            unet[name] = replace(unet[name], low_rank=(up, down))
            return
    found.unknown.append(key)
