"""Sizes and modes of the network: as published, as a checkpoint states them, as its tensors show them.

A checkpoint states them as the text of a constructor call, the hub's form as JSON. Neither is executed. Sizes
also follow from the shapes of the tensors, all but the numbers of heads; the two accounts have to agree.
"""

import ast
import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, cast, get_args

from dreamdrive.errors import InputError

HeadKind = Literal["dpt", "linear"]
DepthMode = Literal["exp", "linear", "square"]
ConfidenceMode = Literal["exp", "sigmoid"]

CLASS = "AsymmetricCroCo3DStereo"
"""Name of the network's class in the authors' checkpoints."""
HEAD_DIM = 64
"""Channels of a head in all published models; only needed where nothing states the number of heads."""

_LARGEST_PX, _LARGEST_RATIO = 4096, 64.0
_FROM_SHAPES = ("enc_dim", "enc_depth", "dec_dim", "dec_depth", "patch", "head")


@dataclass(frozen=True)
class DptSizes:
    """Widths of the DPT head; the defaults are those of all published models."""

    layer_dims: tuple[int, int, int, int] = (96, 192, 384, 768)  # channels of the four feature images
    feature_dim: int = 256  # to which these are brought
    last_dim: int = 128  # channels at full resolution


@dataclass(frozen=True)
class NetworkConfig:
    """Sizes and modes of encoder and decoders; the defaults are those of the published model 512_dpt."""

    enc_dim: int = 1024  # channels of a token
    enc_depth: int = 24  # layers
    enc_heads: int = 16  # of the attention
    dec_dim: int = 768
    dec_depth: int = 12
    dec_heads: int = 12
    patch: int = 16  # side in pixels of the square that a token stands for
    mlp_ratio: float = 4.0  # width of the inner linear layer over that of a token
    head: HeadKind = "dpt"
    dpt: DptSizes = field(default_factory=DptSizes)  # without meaning for the linear head
    depth_mode: DepthMode = "exp"  # how the length of a raw vector becomes the distance of a point
    conf_mode: ConfidenceMode = "exp"
    conf_range: tuple[float, float] = (1.0, math.inf)  # least and largest
    rope_base: float = 100.0  # ratio of the angular frequencies of the rotary embedding
    image_size: int = 512  # long side in pixels of the pictures it was trained with; 224 means squares

    def __post_init__(self) -> None:
        sizes = (self.enc_depth, self.dec_depth, self.enc_heads, self.dec_heads, self.patch, self.image_size)
        if min(sizes) < 1:
            raise ValueError("depths, numbers of heads, patch and image size must be positive")
        for name, dim, heads in (
            ("encoder", self.enc_dim, self.enc_heads),
            ("decoder", self.dec_dim, self.dec_heads),
        ):
            if dim < 1 or dim % (4 * heads):
                raise ValueError(f"{name}: {dim} channels do not split into {heads} heads of a multiple of 4")
        if self.head == "dpt" and self.patch != 16:
            raise ValueError(f"the DPT head needs patches of 16 px, not {self.patch}")
        if not self.conf_range[0] < self.conf_range[1]:
            raise ValueError(f"confidences from {self.conf_range[0]} to {self.conf_range[1]} are no range")
        if self.conf_mode == "sigmoid" and not all(map(math.isfinite, self.conf_range)):
            raise ValueError("confidences by a sigmoid need two finite bounds")

    def hidden(self, dim: int) -> int:
        """Width of the inner linear layer of a block of ``dim`` channels."""
        return int(dim * self.mlp_ratio)


def config_from_call(text: str, source: str) -> NetworkConfig:
    """Configuration from a constructor call as text, which is parsed and not executed.

    For example ``AsymmetricCroCo3DStereo(pos_embed='RoPE100', head_type='dpt', ...)``.
    """
    try:
        call = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"{source}: the model {_short(text)} is no constructor call") from None
    if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name) or call.func.id != CLASS:
        raise InputError(f"{source}: the model {_short(text)} is another one; expected {CLASS}(...)")
    known = {word.arg: word.value for word in call.keywords if word.arg in _KEYWORDS}
    values = {str(name): _value(node, str(name), source) for name, node in known.items()}
    return config_from_keywords(values, source)


def config_from_json(text: str, source: str) -> NetworkConfig:
    """Configuration from the hub's ``config.json``: the constructor's keywords, ``Infinity`` a number."""
    try:
        # The one JSON that states infinities; what it says of anything else is checked value by value.
        values = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source} is not JSON ({error})") from None
    if not isinstance(values, dict):
        raise InputError(f"{source} holds no JSON object; expected the keywords of {CLASS}")
    return config_from_keywords(values, source)


def config_from_keywords(given: Mapping[str, Any], source: str) -> NetworkConfig:
    """Configuration from the keywords of the authors' constructor, with its defaults; others are ignored."""
    values: dict[str, Any] = {}
    for name, (default, fits, expected) in _KEYWORDS.items():
        values[name] = value = given.get(name, default)
        if not fits(value):
            raise InputError(f"{source}: {name} {_short(value)}{expected}")
    depth_mode, *depth_range = values["depth_mode"]
    if depth_range != [-math.inf, math.inf]:
        raise InputError(f"{source}: depth_mode with bounds {depth_range} is not supported; expected none")
    conf_mode, least, most = values["conf_mode"]
    return _make(
        source,
        enc_dim=values["enc_embed_dim"],
        enc_depth=values["enc_depth"],
        enc_heads=values["enc_num_heads"],
        dec_dim=values["dec_embed_dim"],
        dec_depth=values["dec_depth"],
        dec_heads=values["dec_num_heads"],
        patch=values["patch_size"],
        mlp_ratio=float(values["mlp_ratio"]),
        head=values["head_type"],
        depth_mode=depth_mode,
        conf_mode=conf_mode,
        conf_range=(float(least), float(most)),
        rope_base=_rope_base(values["pos_embed"]),
        image_size=max(_sides(values["img_size"])),
    )


def config_from_shapes(
    shapes: Mapping[str, tuple[int, ...]], source: str, heads: tuple[int, int] | None = None
) -> NetworkConfig:
    """Configuration from the shapes of a state dict; published modes are assumed.

    No shape tells the heads of encoder and decoders; None assumes 64 channels each.
    """

    def shape(key: str, sides: int) -> tuple[int, ...]:
        found = shapes.get(key)
        if found is None:
            raise InputError(f"{source} is no DUSt3R model: there is no tensor {key}")
        if len(found) != sides:
            raise InputError(f"{source}: {key} has the shape {found}, not {sides} sides")
        return found

    enc_dim, _, patch, _ = shape("patch_embed.proj.weight", 4)
    dec_dim, _ = shape("decoder_embed.weight", 2)
    hidden, _ = shape("enc_blocks.0.mlp.fc1.weight", 2)
    head: HeadKind = "dpt" if any(key.startswith("downstream_head1.dpt.") for key in shapes) else "linear"
    dpt = DptSizes()
    if head == "dpt":
        a, b, c, d = (shape(f"downstream_head1.dpt.act_postprocess.{i}.0.weight", 4)[0] for i in range(4))
        last_dim, feature_dim, _, _ = shape("downstream_head1.dpt.head.0.weight", 4)
        dpt = DptSizes((a, b, c, d), feature_dim, last_dim)
    enc_heads, dec_heads = heads or (max(enc_dim // HEAD_DIM, 1), max(dec_dim // HEAD_DIM, 1))
    return _make(
        source,
        enc_dim=enc_dim,
        enc_depth=_depth(shapes, "enc_blocks"),
        enc_heads=enc_heads,
        dec_dim=dec_dim,
        dec_depth=_depth(shapes, "dec_blocks"),
        dec_heads=dec_heads,
        patch=patch,
        mlp_ratio=hidden / max(enc_dim, 1),
        head=head,
        dpt=dpt,
    )


def check_agreement(stated: NetworkConfig, found: NetworkConfig, source: str) -> None:
    """Refuse a checkpoint that states something else than what its tensors show."""
    trouble = [
        f"{name} is stated as {getattr(stated, name)!r}, the tensors have {getattr(found, name)!r}"
        for name in _FROM_SHAPES
        if getattr(stated, name) != getattr(found, name)
    ]
    if trouble:
        raise InputError(
            f"{source}: statement and weights disagree ({'; '.join(trouble)}); take both from the same model"
        )


def _make(source: str, **values: Any) -> NetworkConfig:
    try:
        return NetworkConfig(**values)
    except ValueError as error:
        raise InputError(f"{source}: {error}") from None


def _depth(shapes: Mapping[str, tuple[int, ...]], blocks: str) -> int:
    numbers = {int(m.group(1)) for key in shapes if (m := re.match(rf"{blocks}\.(\d{{1,4}})\.", key))}
    # Where one is left out the last number says more than there are, and what is missing is then named.
    return min(max(numbers, default=-1) + 1, 2 * len(numbers))


def _value(node: ast.expr, name: str, source: str) -> Any:
    """A constant, a tuple of constants, infinity, or the negative of a number."""
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.Tuple | ast.List):
        return tuple(_value(item, name, source) for item in node.elts)
    if isinstance(node, ast.Name) and node.id == "inf":
        return math.inf
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        value = _value(node.operand, name, source)
        if isinstance(value, int | float):
            return -value
    raise InputError(f"{source}: {name}={_short(ast.unparse(node))} is no plain value")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value)


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _mode(kinds: tuple[str, ...]) -> tuple[Callable[[Any], bool], str]:
    def fits(value: Any) -> bool:
        listed = isinstance(value, tuple | list) and len(cast("Sequence[Any]", value)) == 3
        return listed and value[0] in kinds and all(map(_is_number, value[1:]))

    return fits, f"; expected a kind of {', '.join(kinds)} and two bounds"


def _rope_base(value: object) -> float:
    """The base in a name such as RoPE100; NaN where it names another embedding."""
    match = re.fullmatch(r"RoPE(\d+(?:\.\d+)?)", str(value))
    return float(match.group(1)) if match else math.nan


def _sides(value: Any) -> Sequence[Any]:
    return value if isinstance(value, tuple | list) else (value,)


_WHOLE = (_is_whole, "; expected a whole number")
_KEYWORDS: dict[str, tuple[Any, Callable[[Any], bool], str]] = {
    "img_size": (
        224,
        lambda v: len(_sides(v)) > 0 and all(_is_whole(s) and 0 < s <= _LARGEST_PX for s in _sides(v)),
        f"; expected one or two positive numbers up to {_LARGEST_PX}",
    ),
    "patch_size": (16, *_WHOLE),
    "enc_embed_dim": (768, *_WHOLE),
    "enc_depth": (12, *_WHOLE),
    "enc_num_heads": (12, *_WHOLE),
    "dec_embed_dim": (512, *_WHOLE),
    "dec_depth": (8, *_WHOLE),
    "dec_num_heads": (16, *_WHOLE),
    "mlp_ratio": (
        4,
        lambda v: _is_number(v) and 0 < v <= _LARGEST_RATIO,
        f"; expected more than 0 and at most {_LARGEST_RATIO:g}",
    ),
    "norm_im2_in_dec": (True, lambda v: v is True, " is not supported; expected True"),
    "pos_embed": (
        "cosine",
        lambda v: 0 < _rope_base(v) < math.inf,
        " is not supported; expected RoPE100 or the like",
    ),
    "output_mode": ("pts3d", lambda v: v == "pts3d", " is not supported; expected 'pts3d'"),
    "head_type": ("linear", lambda v: v in get_args(HeadKind), "; expected 'dpt' or 'linear'"),
    "depth_mode": (("exp", -math.inf, math.inf), *_mode(get_args(DepthMode))),
    "conf_mode": (("exp", 1, math.inf), *_mode(get_args(ConfidenceMode))),
}
"""Keywords of the authors' constructor: what it takes where none is given, what fits, what was expected."""


def _short(value: object) -> str:
    if isinstance(value, str):
        return repr(value if len(value) <= 60 else value[:57] + "...")
    said = repr(value)
    return said if len(said) <= 60 else said[:57] + "..."
