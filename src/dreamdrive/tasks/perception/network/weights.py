"""Weights of Cross-View Transformers from files: ours, released checkpoints, the trunk's of ImageNet."""

import re
from collections import defaultdict
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import msgspec
from safetensors import safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import JSON_RAISES
from dreamdrive.files.output import new_file
from dreamdrive.files.tensor_file import briefly
from dreamdrive.models import as_state, check_sizes, fill, read_state, read_torch
from dreamdrive.street_network import SHIPPED, weights_of
from dreamdrive.tasks.perception.network.backbone import PART_STARTS, EfficientNetFront
from dreamdrive.tasks.perception.network.network import CrossViewTransformer
from dreamdrive.tasks.perception.network.street_trunk import LAYER_STARTS, StreetTrunk
from dreamdrive.tasks.perception.options import CvtOptions

EXPECTED = "a Cross-View Transformer of these sizes and classes, as .safetensors or a released .ckpt"
IMAGENET = "EfficientNet-B4 of the package efficientnet_pytorch, as .safetensors or its .pth"
_RELEASED = "backbone."
"""Before all keys of the network in a checkpoint of its training."""
_BLOCK = re.compile(r"_blocks\.(\d+)\.(.+)")
_STREET_BLOCK = re.compile(r"encoder\.blocks\.(\d+)\.(.+)")


def save_cvt(network: CrossViewTransformer, path: Path) -> None:
    """Write weights and options as a .safetensors; networks with a backbone of the caller's as well."""
    state = {key: value.detach().cpu().contiguous() for key, value in network.state_dict().items()}
    with new_file(path) as partial:
        save_file(state, partial, {"options": msgspec.json.encode(network.options).decode()})


def load_cvt(
    path: Path, options: CvtOptions | None = None, backbone: nn.Module | None = None
) -> CrossViewTransformer:
    """A network with the weights of a file, for inference.

    Args:
        path: What ``save_cvt`` wrote, another .safetensors or ``torch.save`` file of the keys of the
            original, or a checkpoint of the original's training. Nothing in it is executed.
        options: Sizes and classes; None for those that ``save_cvt`` wrote, or else the published ones for
            vehicles.
        backbone: See ``CrossViewTransformer``.

    Raises:
        InputError: The file is damaged or holds another network.
    """
    network = CrossViewTransformer(options or _said(path) or CvtOptions(), backbone)
    return fill(network, _state(path), str(path), EXPECTED)


def load_imagenet(trunk: EfficientNetFront, path: Path) -> None:
    """Put the weights that were trained on ImageNet into a trunk of width 1, from which training starts.

    Raises:
        InputError: The file is damaged or holds another network.
    """
    found = read_state(path, IMAGENET)
    state = {ours: value for key, value in found.items() if (ours := _trunk_key(key)) is not None}
    fill(trunk, state, str(path), IMAGENET).requires_grad_(True)


def load_street(trunk: StreetTrunk, given: str | Path = SHIPPED) -> None:
    """Put the weights of the street network into a trunk: those that ship, or those in a file.

    Raises:
        InputError: The file is missing, damaged or of something else.
    """
    path = weights_of(given)
    found = read_state(path, "weights of the street network")
    state = {ours: value for key, value in found.items() if (ours := _street_key(key)) is not None}
    fill(trunk, state, str(path), "weights of the street network").requires_grad_(True)


def _said(path: Path) -> CvtOptions | None:
    """The options in a file, if it holds any."""
    if path.suffix != ".safetensors":
        return None
    read_state(path, EXPECTED)  # which is where a damaged file is refused
    with safe_open(path, "pt") as file:
        said = (file.metadata() or {}).get("options")
    if said is None:
        return None
    try:
        check_sizes(msgspec.json.decode(said), str(path))
        return msgspec.json.decode(said, type=CvtOptions)
    except JSON_RAISES as error:
        raise InputError(f"{path}: its options are damaged ({briefly(error)}); expected {EXPECTED}") from None


def _state(path: Path) -> dict[str, Tensor]:
    if path.suffix == ".safetensors":
        state = read_state(path, EXPECTED)
    else:
        content: Any = read_torch(path, EXPECTED, _configuration())
        holds = isinstance(content, dict) and "state_dict" in content
        state = as_state(
            cast("dict[str, Any]", content)["state_dict"] if holds else content, str(path), EXPECTED
        )
    inside = {key.removeprefix(_RELEASED): each for key, each in state.items() if key.startswith(_RELEASED)}
    return inside or state


def _street_key(key: str) -> str | None:
    """Our key for one of the street network; None for what is behind block 10."""
    if key.startswith("encoder.stem."):
        return key.replace("encoder.stem.", "layers.0.")
    match = _STREET_BLOCK.fullmatch(key)
    return None if match is None else _in_layer(int(match[1]), match[2], LAYER_STARTS)


def _trunk_key(key: str) -> str | None:
    """Our key for one of the package's; None for what is behind block 10."""
    if key.startswith("_conv_stem."):
        return key.replace("_conv_stem.", "layers.0.0.")
    if key.startswith("_bn0."):
        return key.replace("_bn0.", "layers.0.1.")
    match = _BLOCK.fullmatch(key)
    return None if match is None else _in_layer(int(match[1]), match[2], PART_STARTS)


def _in_layer(block: int, name: str, starts: tuple[int, ...]) -> str | None:
    """The key of something in a block, by the first blocks of the layers behind the stem."""
    for layer, (start, end) in enumerate(pairwise(starts), start=1):
        if start <= block < end:
            return f"layers.{layer}.{block - start}.{name}"
    return None


def _configuration() -> list[type]:
    """Stand-ins for what beside tensors lies in a released checkpoint: its configuration, which is not used.

    They have the names of the classes and none of their code.
    """
    names = {
        "omegaconf.dictconfig": ("DictConfig",),
        "omegaconf.listconfig": ("ListConfig",),
        "omegaconf.base": ("ContainerMetadata", "Metadata"),
        "omegaconf.nodes": ("AnyNode", "StringNode", "IntegerNode", "FloatNode", "BooleanNode"),
        "pytorch_lightning.callbacks.model_checkpoint": ("ModelCheckpoint",),
        "pytorch_lightning.callbacks.lr_monitor": ("LearningRateMonitor",),
        "pytorch_lightning.utilities.parsing": ("AttributeDict",),
    }
    made = [type(name, (dict,), {"__module__": module}) for module, each in names.items() for name in each]
    return [*made, dict, list, str, int, float, bool, defaultdict, cast("type", Any)]
