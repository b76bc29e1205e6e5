"""Weights on disk, an official single file or a folder in diffusers' layout; read where they are used."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.files.tensor_file import DAMAGE, briefly, header_problem
from dreamdrive.models import check_sizes, in_words, misfits, some
from dreamdrive.prior.vista.configs import Shapes, config_of
from dreamdrive.prior.vista.keys import PARTS, Part, Recipes, recipes_of
from dreamdrive.prior.vista.kinds import ACTION_COLUMNS, KINDS, SVD, VISTA, ModelKind
from dreamdrive.prior.vista.networks import make_empty

EXPECTED = (
    "vista.safetensors of OpenDriveLab/Vista, svd_xt.safetensors, a folder that dreamdrive prior convert "
    "made, or the folder of stable-video-diffusion-img2vid-xt"
)
NOTE = "prior.json"
"""The file that says which kind a converted folder holds."""
FILES: dict[Part, tuple[str, ...]] = {
    "unet": ("diffusion_pytorch_model.safetensors", "diffusion_pytorch_model.fp16.safetensors"),
    "vae": ("diffusion_pytorch_model.safetensors", "diffusion_pytorch_model.fp16.safetensors"),
    "image_encoder": ("model.safetensors", "model.fp16.safetensors"),
}
TITLES: dict[Part, str] = {"unet": "UNet", "vae": "VAE", "image_encoder": "image encoder"}
_NEEDED: dict[Part, tuple[str, ...]] = {
    "unet": ("block_out_channels", "cross_attention_dim"),
    "vae": ("block_out_channels",),
    "image_encoder": ("projection_dim", "image_size"),
}
"""What of the configuration is used beside the network's making."""
_SHOWN: dict[Part, tuple[str, ...]] = {
    "unet": ("block_out_channels", "layers_per_block", "transformer_layers_per_block", "cross_attention_dim"),
    "vae": ("block_out_channels", "layers_per_block"),
    "image_encoder": ("hidden_size", "intermediate_size", "num_hidden_layers", "patch_size", "image_size"),
}
"""What of the configuration the tensors show too."""
# What the classes of networks raise on sizes that do not fit each other.
_NO_NETWORK = (TypeError, ValueError, KeyError, AttributeError, IndexError, ArithmeticError, RuntimeError)
_SECOND_TIME = "cond_time_embedding."
FIRST, QUANT = "conditioner.embedders.3.encoder.encoder.", "conditioner.embedders.3.encoder.quant_conv."
SECOND = "first_stage_model.encoder."
_LAST = ("conv_out.weight", "conv_out.bias")
_SAME = 1e-3  # of a tensor's largest number: the rounding of half precision


@dataclass(frozen=True)
class StoredPart:
    """One network: configuration of its class, shapes of its tensors, and a reader of one by its name."""

    config: dict[str, Any]
    shapes: Shapes
    read: Callable[[str], Tensor]

    @property
    def count(self) -> int:
        """How many numbers it has."""
        return sum(torch.Size(shape).numel() for shape in self.shapes.values())


@dataclass(frozen=True)
class StoredModel:
    """A video model on disk, checked by names and shapes; ``ignored`` keys are left out on purpose."""

    path: Path
    kind: ModelKind
    parts: Mapping[Part, StoredPart]
    ignored: tuple[str, ...] = ()


def open_weights(path: Path, wanted: ModelKind | None = None) -> StoredModel:
    """Look at weights (see ``EXPECTED``) without reading them, and refuse all that is not ``wanted``.

    Files may be damaged, tensors missing, unknown or of another shape, or it may be the other model.
    """
    folder = path.is_dir() and (path / "unet").is_dir()
    stored = _open_folder(path) if folder else _open_file(_single(path))
    if wanted is not None and stored.kind is not wanted:
        raise InputError(
            f"{path} holds {stored.kind.title}, not {wanted.title}: use --prior {stored.kind.name}, or give "
            f"the weights of {wanted.title}"
        )
    for part in PARTS:
        _check(stored, part)
    actions = ACTION_COLUMNS if stored.kind is VISTA else 0
    columns = stored.parts["unet"].config["cross_attention_dim"]
    image = int(stored.parts["image_encoder"].config["projection_dim"])
    if columns != image + actions:
        raise InputError(
            f"{path}: the UNet takes a context of {columns} columns; expected {image} of the image encoder "
            f"and {actions} of the action"
        )
    return stored


def _single(path: Path) -> Path:
    """The single file: itself, or the only one in a folder."""
    if not path.is_dir():
        return path
    found = sorted(path.glob("*.safetensors"))
    if len(found) != 1:
        raise InputError(f"{path} holds no unet/ and {len(found)} files .safetensors; expected {EXPECTED}")
    return found[0]


def open_tensors(path: Path) -> tuple[Shapes, Callable[[str], Tensor]]:
    """Shapes by key of a ``.safetensors``, and a reader of one tensor."""
    if not path.is_file():
        raise InputError(f"{path} does not exist or is no file; expected {EXPECTED}")
    try:
        if problem := header_problem(path):
            raise SafetensorError(problem)
        file = safe_open(path, "pt")
        shapes = {key: tuple(file.get_slice(key).get_shape()) for key in file.keys()}  # noqa: SIM118
    except DAMAGE as error:
        raise InputError(
            f"{path} is no .safetensors or is cut short ({briefly(error)}); copy it again, expected "
            f"{EXPECTED}"
        ) from None

    def read(key: str) -> Tensor:
        value = file.get_tensor(key)
        if not value.is_floating_point():
            raise InputError(f"{path}: {briefly(key)} holds {value.dtype}; expected floating-point numbers")
        return value

    return shapes, read


def _open_file(path: Path) -> StoredModel:
    shapes, read = open_tensors(path)
    recipes = recipes_of(shapes)
    if recipes.unknown:
        raise InputError(f"{path} holds unknown tensors: {some(recipes.unknown)}; expected {EXPECTED}")
    kind = _kind_of(path, recipes)
    parts: dict[Part, StoredPart] = {part: _part(path, part, recipes, shapes, read) for part in PARTS}
    return StoredModel(path, kind, parts, tuple(recipes.ignored))


def _kind_of(path: Path, recipes: Recipes) -> ModelKind:
    """Vista has action adapters and a second time embedding, SVD has neither."""
    second = any(name.startswith(_SECOND_TIME) for name in recipes.parts["unet"])
    if second != bool(recipes.actions):
        lacking = "the UNet's second time embedding" if recipes.actions else "the action adapters"
        raise InputError(f"{path}: {lacking} (all of it) is missing; expected {EXPECTED}")
    return VISTA if second else SVD


def _part(
    path: Path, part: Part, recipes: Recipes, shapes: Shapes, read: Callable[[str], Tensor]
) -> StoredPart:
    chosen = recipes.parts[part]
    if not chosen:
        raise InputError(f"{path}: the {TITLES[part]} is missing altogether; expected {EXPECTED}")
    try:
        own = recipes.shapes(part, shapes)
        config = config_of(part, own)
    except KeyError as error:
        raise InputError(
            f"{path}: the {TITLES[part]} lacks {briefly(error.args[0])} and more; expected {EXPECTED}"
        ) from None
    except (RuntimeError, ValueError, IndexError, ArithmeticError) as error:
        raise InputError(
            f"{path}: tensors of the {TITLES[part]} do not fit together ({briefly(error)})"
        ) from None
    return StoredPart(config, own, lambda name: chosen[name].make(read))


def _open_folder(path: Path) -> StoredModel:
    parts: dict[Part, StoredPart] = {part: _folder_part(path, part) for part in PARTS}
    second = any(name.startswith(_SECOND_TIME) for name in parts["unet"].shapes)
    kind = VISTA if second else SVD
    if (path / NOTE).is_file():
        kind = KINDS.get(str(read_json(path / NOTE, "--weights").get("kind")), kind)
    return StoredModel(path, kind, parts)


def _folder_part(path: Path, part: Part) -> StoredPart:
    there = [path / part / name for name in FILES[part] if (path / part / name).is_file()]
    config = path / part / "config.json"
    if not there or not config.is_file():
        raise InputError(f"{path / part} lacks config.json or {FILES[part][0]}; expected {EXPECTED}")
    shapes, read = open_tensors(there[0])
    # Older versions of transformers stored these counting numbers.
    shapes = {name: shape for name, shape in shapes.items() if not name.endswith(".position_ids")}
    return StoredPart(read_json(config, "--weights"), shapes, read)


def _check(stored: StoredModel, part: Part) -> None:
    """Whether the tensors are those of the network, by name and shape."""
    own = stored.parts[part]
    if lacking := [name for name in _NEEDED[part] if name not in own.config]:
        raise InputError(f"{stored.path}: config.json of the {TITLES[part]} does not tell {lacking[0]}")
    _check_config(stored, part)
    try:
        network = make_empty(part, own.config, stored.kind)
    except _NO_NETWORK as error:
        raise InputError(
            f"{stored.path}: config.json of the {TITLES[part]} is of no use ({briefly(error)})"
        ) from None
    wanted = {name: tuple(value.shape) for name, value in network.state_dict().items()}
    if wrong := misfits(wanted, own.shapes):
        raise InputError(
            f"{stored.path}: the {_blamed(part, wrong)} does not fit ({in_words(wrong)}); expected {EXPECTED}"
        )


def _check_config(stored: StoredModel, part: Part) -> None:
    """Whether the sizes in a configuration are those of the tensors, before a network is built of them."""
    own = stored.parts[part]
    where = f"{stored.path}: config.json of the {TITLES[part]}"
    check_sizes(own.config, where)
    try:
        shown = config_of(part, own.shapes)
    except (KeyError, ValueError, IndexError):
        return  # the network's own names tell better what is missing
    for name in _SHOWN[part]:
        stated = own.config.get(name, shown[name])
        if stated != shown[name] and stated != [shown[name]] * len(shown.get("block_out_channels", [])):
            raise InputError(
                f"{where} states {name} {stated}, the tensors have {shown[name]}; take both from one model"
            )


def _blamed(part: Part, groups: dict[str, list[str]]) -> str:
    """What to call the part that does not fit: of the UNet, the action adapters may be what is missing."""
    narrow = [name for name in groups.get("of a wrong shape", []) if ".attn2.to_" in name]
    whole = part != "unet" or not narrow or len(narrow) < sum(len(names) for names in groups.values())
    return TITLES[part] if whole else "set of action adapters"


def notes_of(stored: StoredModel) -> list[str]:
    """What has to be said of a model's encoders, a sentence each: nothing where one does the work of both."""
    if stored.path.is_dir():
        note = stored.path / NOTE
        said = read_json(note, "--weights").get("notes") if note.is_file() else None
        return [str(each) for each in cast("list[Any]", said)] if isinstance(said, list) else []
    difference = encoder_difference(stored.path)
    if difference is None or difference <= _SAME:
        return []
    return [
        f"The two image encoders of {stored.path.name} differ, by up to {difference:.1%} of a tensor's "
        "largest number; the one of the first frame encodes known frames, too, which is not what the model "
        "was trained with."
    ]


def encoder_difference(path: Path) -> float | None:
    """How far the encoders of a single file are apart: the largest difference over a tensor's largest number.

    The file holds an encoder that tells the network of the first frame, with a 1x1 convolution Q behind it,
    and one that encodes known frames, without. Here the first one does both. That is the same where all their
    tensors are, but the last convolution: there Q has to be contained in the second. None without one.
    """
    shapes, read = open_tensors(path)
    names = {
        prefix: {key.removeprefix(prefix) for key in shapes if key.startswith(prefix)}
        for prefix in (FIRST, SECOND)
    }
    if not names[SECOND]:
        return None
    other = names[FIRST] ^ names[SECOND]
    other |= {n for n in names[FIRST] & names[SECOND] if shapes[FIRST + n] != shapes[SECOND + n]}
    if other or not names[FIRST].issuperset(_LAST):
        raise InputError(
            f"{path}: its two image encoders are of different forms ({min(other or _LAST)}); expected "
            "two of one form: copy the file again"
        )
    apart = [
        _apart(read(FIRST + name).float(), read(SECOND + name).float())
        for name in sorted(names[FIRST].difference(_LAST))
    ]
    last = [read(SECOND + name).float() for name in _LAST]
    apart += [_apart(mine, theirs) for mine, theirs in zip(_with_quant(read), last, strict=True)]
    return max(apart)


def _with_quant(read: Callable[[str], Tensor]) -> tuple[Tensor, Tensor]:
    """Weights and bias of the first encoder's last convolution with Q behind it, as one."""
    weight, bias = (read(FIRST + name).float() for name in _LAST)
    quant = read(f"{QUANT}weight").float()[..., 0, 0]
    return torch.einsum("oc,cikl->oikl", quant, weight), quant @ bias + read(f"{QUANT}bias").float()


def _apart(first: Tensor, second: Tensor) -> float:
    return float((first - second).abs().max() / first.abs().max().clamp(min=1e-12))
