"""The two ``config.json`` of a MagicDrive folder, checked for what is built here."""

from dataclasses import dataclass
from typing import Any

from dreamdrive.errors import InputError
from dreamdrive.files.checked import build
from dreamdrive.prior.magicdrive.cameras import NUSCENES, crop
from dreamdrive.prior.magicdrive.condition import CHANNELS, CLASSES

EXPECTED = (
    "a folder with unet/ and controlnet/ of MagicDrive (of MagicDrive-t for --prior magicdrive-t) and "
    "text_encoder/, tokenizer/, vae/ and scheduler/ of Stable Diffusion 1.5"
)
KEY_FRAMES = 6
"""Every so many frames of the temporal variant is a key frame."""

_PLAIN_SD = "this is plain Stable Diffusion; expected MagicDrive's own unet/ and controlnet/"
_UNET = {
    "neighboring_attn_type": ("add",),
    "crossview_attn_type": ("basic",),
    "zero_module_type": ("zero_linear",),
    "temp_attn_type": ("_s_ff_t_last", "t_last"),
    "zero_module_type2": ("none", "zero_linear"),
    "temp_pos_emb": ("learnable", "none"),
}
_CONTROLNET: dict[str, tuple[object, ...]] = {"use_uncond_map": (None,)}
_BOXES = {"mode": ("all-xyz",), "minmax_normalize": (False,), "embedder_num_freq": (4,)}
_CAMERA = {"input_dims": (3,), "num_freqs": (4,), "include_input": (True,), "log_sampling": (True,)}


@dataclass(frozen=True)
class Temporal:
    """How the blocks of the temporal variant attend to the other frames of a clip.

    The first attention is ``sparse`` causal (``_s_ff_t_last``), or each frame sees itself (``t_last``). That
    along time has learned positions or none, and a linear layer, the connector, behind it or none.
    """

    frames: int
    sparse: bool
    connector: bool
    positions: bool = True


@dataclass(frozen=True)
class Settings:
    """What the folders say beyond what diffusers' classes take.

    The map's shape is channels and cells of the raster; its encoder's result is averaged to the height and
    width ``map_pooled``, if it is. The views are a ring of cameras. None is temporal about single time steps.
    """

    size: tuple[int, int]
    map_shape: tuple[int, int, int]
    map_widths: tuple[int, ...]
    map_pooled: tuple[int, int] | None
    box_classes: int
    box_class_width: int
    box_widths: tuple[int, int, int, int]
    views: int
    temporal: Temporal | None

    @property
    def frames(self) -> int:
        """Time steps that are sampled together."""
        return 1 if self.temporal is None else self.temporal.frames


def read_settings(unet: dict[str, Any], controlnet: dict[str, Any]) -> Settings:
    """What ``config.json`` of unet and controlnet say beyond what diffusers' classes take."""
    if "neighboring_view_pair" not in unet:
        raise InputError(f"unet/config.json has no neighboring_view_pair: {_PLAIN_SD}")
    if "bbox_embedder_param" not in controlnet:
        raise InputError(f"controlnet/config.json has no bbox_embedder_param: {_PLAIN_SD}")
    try:
        settings = parse_settings(unet, controlnet)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        what = f"{type(error).__name__}: {error}"
        raise InputError(f"config.json of unet/ or controlnet/ is not one of MagicDrive ({what})") from None
    channels, *cells = settings.map_shape
    if channels != len(CHANNELS) or len(set(cells)) != 1:
        raise InputError(
            f"controlnet/config.json: the map is {settings.map_shape}; only square maps of the "
            f"{len(CHANNELS)} channels {', '.join(CHANNELS)} are drawn here"
        )
    if settings.views != len(NUSCENES):
        raise InputError(f"unet/config.json: {settings.views} cameras; expected a ring of {len(NUSCENES)}")
    if settings.box_classes != len(CLASSES):
        raise InputError(
            f"controlnet/config.json: n_classes is {settings.box_classes}; expected {len(CLASSES)}"
        )
    crop(settings.size)  # complains where pictures of that size are no part of the cameras'
    return settings


def parse_settings(unet: dict[str, Any], controlnet: dict[str, Any]) -> Settings:
    """The same of any network that is built here, whether or not there are inputs of its shapes."""
    boxes = controlnet["bbox_embedder_param"]
    _refuse_others("unet/config.json", unet, _UNET)
    _refuse_others("controlnet/config.json", controlnet, _CONTROLNET)
    _refuse_others("controlnet/config.json, bbox_embedder_param", boxes, _BOXES)
    _refuse_others("controlnet/config.json, cam_embedder_param", controlnet["cam_embedder_param"], _CAMERA)
    height, width = (int(side) for side in unet["img_size"])
    pooled, shape, widths = _map_encoder(controlnet)
    values = {
        "size": (width, height),
        "map_shape": shape,
        "map_widths": widths,
        "map_pooled": pooled,
        "box_classes": boxes["n_classes"],
        "box_class_width": boxes["class_token_dim"],
        "box_widths": tuple(boxes["proj_dims"]),
        "views": _ring(unet["neighboring_view_pair"]),
        "temporal": _temporal(unet),
    }
    return build(Settings, values)


def _map_encoder(
    config: dict[str, Any],
) -> tuple[tuple[int, int] | None, tuple[int, int, int], tuple[int, ...]]:
    """Where its result is averaged to, shape of the raster and widths."""
    if config["map_embedder_cls"] is None:
        return None, tuple(config["map_size"]), tuple(config["conditioning_embedding_out_channels"])
    if not str(config["map_embedder_cls"]).endswith("BEVControlNetConditioningEmbeddingPlus"):
        raise InputError(
            f"controlnet/config.json: map_embedder_cls {config['map_embedder_cls']} is not built here"
        )
    given = config["map_embedder_param"]
    size, shape = given["conditioning_embedding_size"], given["conditioning_size"]
    return tuple(size), tuple(shape), tuple(given["block_out_channels"])


def _ring(neighbours: dict[str, list[int]]) -> int:
    """Number of cameras, each of which sees the one before and the one after it."""
    count = len(neighbours)
    ring = {str(i): [(i - 1) % count, (i + 1) % count] for i in range(count)}
    if ring != neighbours:
        raise InputError(
            f"unet/config.json: neighboring_view_pair is {neighbours}; "
            f"expected a ring of {len(NUSCENES)} cameras"
        )
    return count


def _temporal(config: dict[str, Any]) -> Temporal | None:
    if "temp_attn_type" not in config:
        return None
    frames, sparse = int(config["video_length"]), config["temp_attn_type"] == "_s_ff_t_last"
    if sparse and frames <= 2 * KEY_FRAMES:
        raise InputError(
            f"unet/config.json: video_length is {frames}; _s_ff_t_last needs at least {2 * KEY_FRAMES + 1}"
        )
    connector = config.get("zero_module_type2", "zero_linear") == "zero_linear"
    return Temporal(frames, sparse, connector, config.get("temp_pos_emb", "learnable") == "learnable")


def _refuse_others(where: str, config: dict[str, Any], built: dict[str, tuple[Any, ...]]) -> None:
    for key, values in built.items():
        if key in config and config[key] not in values:
            raise InputError(
                f"{where}: {key} is {config[key]!r}; of MagicDrive only "
                f"{' or '.join(repr(value) for value in values)} is built here"
            )
