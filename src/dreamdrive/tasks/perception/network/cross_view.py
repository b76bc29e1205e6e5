"""Cross-view attention: from maps of features to a street from above (Zhou and Krähenbühl 2022)."""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.compute.device import CPU
from dreamdrive.tasks.perception.grid import BevGrid

_GUARD = 1e-7
"""Beside the norms of codes, which it keeps above zero."""


class BevEmbedding(nn.Module):
    """What is learned for each place of the coarse street from above, and where the places are.

    Attributes:
        learned_features: (dim, h, w), drawn from a normal distribution.
        grid: (2, h, w) x ahead and y left in metres, from border to border of the grid.
    """

    grid: Tensor

    def __init__(self, dim: int, size: tuple[int, int], grid: BevGrid) -> None:
        super().__init__()
        self.learned_features = nn.Parameter(torch.randn(dim, *size))
        ahead = torch.linspace(0.5, -0.5, size[0], dtype=torch.float64) * grid.length_m
        left = torch.linspace(0.5, -0.5, size[1], dtype=torch.float64) * grid.width_m
        places = torch.stack(torch.meshgrid(ahead, left, indexing="ij"))
        self.register_buffer("grid", places.float(), persistent=False)


class CrossAttention(nn.Module):
    """Attention of each place to all pixels of all cameras, with a query of its own for each camera."""

    def __init__(self, dim: int, heads: int, head_dim: int) -> None:
        super().__init__()
        inner = heads * head_dim
        self.to_q = nn.Sequential(nn.LayerNorm(dim), nn.Linear(dim, inner))
        self.to_k = nn.Sequential(nn.LayerNorm(dim), nn.Linear(dim, inner))
        self.to_v = nn.Sequential(nn.LayerNorm(dim), nn.Linear(dim, inner))
        self.proj = nn.Linear(inner, dim)
        self.prenorm = nn.LayerNorm(dim)
        self.mlp = nn.Sequential(nn.Linear(dim, 2 * dim), nn.GELU(), nn.Linear(2 * dim, dim))
        self.postnorm = nn.LayerNorm(dim)
        self._heads, self._scale = heads, head_dim**-0.5

    def forward(
        self,
        queries: Float[Tensor, "b n q d"],
        keys: Float[Tensor, "b n k d"],
        values: Float[Tensor, "b n k d"],
        skip: Float[Tensor, "b q d"],
    ) -> Float[Tensor, "b q d"]:
        """Gather values for each place; one softmax runs over the pixels of all cameras."""
        q, k, v = (self._by_head(each) for each in (self.to_q(queries), self.to_k(keys), self.to_v(values)))
        logits = (self._scale * q) @ k.transpose(-1, -2)  # b m n q k
        shares = logits.transpose(2, 3).flatten(3).softmax(dim=-1)
        gathered = shares.to(v.dtype) @ v.flatten(2, 3)
        x = self.proj(gathered.transpose(1, 2).flatten(2)) + skip
        x = self.prenorm(x)
        return self.postnorm(x + self.mlp(x))

    def _by_head(self, x: Float[Tensor, "b n k inner"]) -> Float[Tensor, "b m n k d"]:
        return x.unflatten(-1, (self._heads, -1)).permute(0, 3, 1, 2, 4)


class CrossView(nn.Module):
    """One look of the street from above at one map of features.

    Args:
        channels: Of the features.
        image: Height and width of the network's pictures in pixels.
        dim: Channels of the street from above.
        heads: Of the attention.
        head_dim: Channels of each head.
    """

    def __init__(self, channels: int, image: tuple[int, int], dim: int, heads: int, head_dim: int) -> None:
        super().__init__()
        self.feature_linear = _norm_first(channels, dim)
        self.feature_proj = _norm_first(channels, dim)
        self.bev_embed = nn.Conv2d(2, dim, 1)
        self.img_embed = nn.Conv2d(4, dim, 1, bias=False)
        self.cam_embed = nn.Conv2d(4, dim, 1, bias=False)
        self.cross_attend = CrossAttention(dim, heads, head_dim)
        self._image = image

    def forward(
        self,
        x: Float[Tensor, "b dim rows columns"],
        places: Float[Tensor, "2 rows columns"],
        features: Float[Tensor, "b n c h w"],
        camera_from_pixel: Float[Tensor, "b n 3 3"],
        ego_from_camera: Float[Tensor, "b n 4 4"],
    ) -> Float[Tensor, "b dim rows columns"]:
        """Look; rays of pixels and places on the ground meet in codes relative to the cameras."""
        b, n, _, h, w = features.shape
        with torch.autocast(x.device.type, enabled=False):  # half precision would be off by pixels
            asked, rays = self._codes(places, h, w, camera_from_pixel.float(), ego_from_camera.float())
        flat = features.flatten(0, 1)
        keys = rays + _rows(self.feature_proj(flat)).unflatten(0, (b, n))
        values = _rows(self.feature_linear(flat)).unflatten(0, (b, n))
        seen = self.cross_attend(asked + _rows(x)[:, None], keys, values, _rows(x))
        return seen.transpose(1, 2).unflatten(2, x.shape[2:])

    def _codes(
        self,
        places: Float[Tensor, "2 rows columns"],
        h: int,
        w: int,
        camera_from_pixel: Float[Tensor, "b n 3 3"],
        ego_from_camera: Float[Tensor, "b n 4 4"],
    ) -> tuple[Float[Tensor, "b n q dim"], Float[Tensor, "b n k dim"]]:
        """Codes of length 1 of places and of rays, for each camera."""
        pixels = image_plane(h, w, self._image, places.device).flatten(1)
        rays = functional.pad(camera_from_pixel @ pixels, (0, 0, 0, 1), value=1.0)
        points = (ego_from_camera @ rays).transpose(-1, -2)
        centres = _at_each(self.cam_embed, ego_from_camera[..., -1])[:, :, None]
        on_ground = _at_each(self.bev_embed, places.flatten(1).T)
        return _unit(on_ground - centres), _unit(_at_each(self.img_embed, points) - centres)


def image_plane(h: int, w: int, image: tuple[int, int], device: torch.device = CPU) -> Float[Tensor, "3 h w"]:
    """Pixels (u, v, 1) of a map of features; its outermost stand on the borders of the picture."""
    u = torch.linspace(0, 1, w, device=device) * image[1]
    v = torch.linspace(0, 1, h, device=device) * image[0]
    return torch.stack([u.expand(h, w), v[:, None].expand(h, w), torch.ones(h, w, device=device)])


def _norm_first(channels: int, dim: int) -> nn.Sequential:
    return nn.Sequential(nn.BatchNorm2d(channels), nn.ReLU(), nn.Conv2d(channels, dim, 1, bias=False))


def _at_each(embed: nn.Conv2d, x: Float[Tensor, "*n c"]) -> Float[Tensor, "*n d"]:
    """Apply a convolution of 1 x 1 to rows of channels."""
    return functional.linear(x, embed.weight.flatten(1), embed.bias)


def _unit(x: Float[Tensor, "*n d"]) -> Float[Tensor, "*n d"]:
    return x / (x.norm(dim=-1, keepdim=True) + _GUARD)


def _rows(x: Float[Tensor, "n d h w"]) -> Float[Tensor, "n hw d"]:
    return x.flatten(2).transpose(1, 2)
