"""Effects between street and picture: haloes, rain and snow in the air, the windscreen, the bonnet."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float

from streetworld.engine.paint import noise

_PAINTS = [
    (12, 12, 14),
    (30, 32, 36),
    (90, 94, 98),
    (150, 152, 154),
    (190, 190, 188),
    (110, 16, 18),
    (20, 34, 80),
]


@dataclass(frozen=True)
class Bonnet:
    """The own bonnet on the picture.

    ``cover`` is its share of every pixel, ``row`` how far a pixel lies below its edge, in heights of the
    picture.
    """

    cover: Float[np.ndarray, "h w"]
    row: Float[np.ndarray, "h w"]
    look: int

    @staticmethod
    def of(look: int, shape: tuple[int, int]) -> "Bonnet":
        """The outline of a look in a picture of a height and width: an arch, perhaps with ribs or a scoop."""
        rng = np.random.default_rng([look, 41])
        height, width = shape
        x = (np.arange(width) + 0.5) / width * 2 - 1
        middle, high = rng.normal(0, 0.12), rng.uniform(0.04, 0.24)
        fall = rng.uniform(0.15, 1.0) * high
        power = rng.choice([2.0, 2.5, 4.0, 6.0])
        edge = high - fall * np.abs(np.clip(x - middle, -1.4, 1.4)) ** power
        if rng.random() < 0.4:  # two ribs along the bonnet
            for side in (-1, 1):
                at = middle + side * rng.uniform(0.3, 0.7)
                edge += 0.012 * np.exp(-(((x - at) / 0.08) ** 2))
        if rng.random() < 0.2:  # an air scoop
            edge += rng.uniform(0.02, 0.04) / (
                1 + np.exp((np.abs(x - middle) - rng.uniform(0.1, 0.25)) / 0.02)
            )
        row = (np.arange(height)[:, None] + 0.5) / height - (1 - edge[None])
        cover = np.clip(row * height + 0.5, 0, 1)
        return Bonnet(cover.astype(np.float32), row.astype(np.float32), look)

    def drawn(self, image: np.ndarray, horizon_row: float, light: np.ndarray) -> np.ndarray:
        """The picture with the bonnet, which mirrors what is above it; ``light`` falls on it from the sky."""
        rng = np.random.default_rng([self.look, 42])
        height, width = self.cover.shape
        colour = (np.array(_PAINTS[int(rng.integers(len(_PAINTS)))], np.float32) / 255) ** 2
        top = int((1 - self.row[-1].max()) * height)
        window = slice(max(0, top - 2), height)
        below = np.maximum(self.row[window], 0)
        # A bonnet curves away: its edge mirrors the horizon, what is nearer the sky above.
        reach = rng.uniform(1.5, 4.0)
        rows = np.clip(horizon_row - reach * below * height + 0.05 * height, 0, height - 1).astype(np.float32)
        columns = np.broadcast_to(np.arange(width, dtype=np.float32)[None], rows.shape)
        seen = cv2.remap(image, np.ascontiguousarray(columns), np.ascontiguousarray(rows), cv2.INTER_LINEAR)
        seen = cv2.GaussianBlur(seen, (0, 0), 0.006 * width * rng.uniform(0.5, 2))
        share = rng.uniform(0.03, 0.12) + rng.uniform(0.15, 0.7) * np.exp(-below / rng.uniform(0.03, 0.1))
        grain = 1 + noise(rng, below.shape, {max(4.0, width / 6): 0.15})
        own = colour * light * grain[..., None] * (0.7 + 0.5 * np.exp(-below / 0.05))[..., None]
        own = own * (1 - share)[..., None] + seen * share[..., None]
        if rng.random() < 0.5:  # the dark gap below the glass
            rim = np.clip((below - rng.uniform(0.06, 0.2)) / 0.01, 0, 1)[..., None]
            own = own * (1 - 0.85 * rim)
        cover = self.cover[window][..., None]
        made = image.copy()
        made[window] += cover * (own - made[window])
        return made


def bloom(image: np.ndarray, share: float) -> np.ndarray:
    """Light of the brightest spots scattered around them."""
    height, width = image.shape[:2]
    over = np.clip(image - 1.1, 0, 6)
    if share <= 0 or not (over > 0).any():
        return np.zeros_like(image)
    small = cv2.resize(over, (max(1, width // 4), max(1, height // 4)), interpolation=cv2.INTER_AREA)
    wide = cv2.GaussianBlur(small, (0, 0), 0.006 * width) + cv2.GaussianBlur(small, (0, 0), 0.025 * width)
    return share * 4 * cv2.resize(wide, (width, height))


def haloes(
    places_px: Float[np.ndarray, "n 2"],
    away_m: Float[np.ndarray, " n"],
    colour: Float[np.ndarray, "n 3"],
    focal_px: float,
    depth_m: Float[np.ndarray, "h w"],
    rng: np.random.Generator,
) -> Float[np.ndarray, "h w 3"]:
    """Light of lamps that shine into the camera: a core, a glow, and rays across it.

    Lamps are given by their places in the picture and their depth; ``depth_m`` is that of the picture,
    infinite in the sky.
    """
    size, star = rng.uniform(0.6, 1.8), rng.random() < 0.4
    height, width = depth_m.shape
    glow = np.zeros((height, width, 3), np.float32)
    for (x, y), z, c in zip(places_px, away_m, colour, strict=True):
        if z < 1 or not (0 <= x < width and 0 <= y < height) or depth_m[int(y), int(x)] < z - 1.0:
            continue
        radius = max(0.7, size * focal_px * 0.12 / z + 0.0022 * size * width)
        _spot(glow, x, y, radius, c * min(1.0, 30 / z), star)
    return glow


def _spot(glow: np.ndarray, x: float, y: float, radius: float, colour: np.ndarray, star: bool) -> None:
    """One halo, in place."""
    height, width = glow.shape[:2]
    reach = int(min(14 * radius, 0.3 * width)) + 2
    x0, x1 = max(0, int(x) - reach), min(width, int(x) + reach + 1)
    y0, y1 = max(0, int(y) - reach), min(height, int(y) + reach + 1)
    dx, dy = np.arange(x0, x1)[None] + 0.5 - x, np.arange(y0, y1)[:, None] + 0.5 - y
    square = (dx**2 + dy**2) / radius**2
    shape = 3.0 * np.exp(-square) + 0.25 / (1 + square) - 0.25 / (1 + 190)
    if star:
        shape = shape + 0.4 * np.exp(-((dy / (0.4 * radius)) ** 2) - np.abs(dx) / (4 * radius))
    glow[y0:y1, x0:x1] += np.maximum(shape, 0).astype(np.float32)[..., None] * colour.astype(np.float32)


def falling(rng: np.random.Generator, image: np.ndarray, rain: float, snow: float) -> np.ndarray:
    """Streaks of rain or flakes in the air."""
    height, width = image.shape[:2]
    mask = np.zeros((height, width), np.uint8)
    slant = rng.normal(0, 0.25)
    for _ in range(int(rain * width * rng.uniform(0.1, 0.5))):
        x, y, long = rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0.02, 0.1) * height
        ends = (round(16 * x), round(16 * y)), (round(16 * (x + slant * long)), round(16 * (y + long)))
        cv2.line(mask, *ends, (int(rng.uniform(20, 90)),), 1, cv2.LINE_AA, 4)
    for _ in range(int(snow * width * rng.uniform(0.2, 1.2))):
        x, y, wide = rng.uniform(0, width), rng.uniform(0, height), rng.exponential(0.0016) * width + 0.4
        cv2.circle(
            mask,
            (round(16 * x), round(16 * y)),
            round(16 * wide),
            (int(rng.uniform(60, 220)),),
            -1,
            cv2.LINE_AA,
            4,
        )
    share = mask.astype(np.float32)[..., None] / 255
    pale = 0.6 * np.percentile(image[::4, ::4], 85, axis=(0, 1)).astype(np.float32) + 0.1
    return image + share * (pale - image)


def drops(rng: np.random.Generator, image: np.ndarray, rain: float) -> np.ndarray:
    """Drops on the glass show the street small and upside down; between them it is a little blurred."""
    height, width = image.shape[:2]
    dx, dy = np.zeros((height, width), np.float32), np.zeros((height, width), np.float32)
    cover = np.zeros((height, width), np.float32)
    wiped = rng.random() < 0.5
    for _ in range(int(rain * rng.uniform(10, 160))):
        radius = min(rng.exponential(0.006) + 0.003, 0.03) * width
        x, y = rng.uniform(0, width), rng.uniform(0, height)
        if (
            wiped
            and np.hypot((x - 0.4 * width) / width, (y - 1.2 * height) / width) < 0.62
            and rng.random() < 0.75
        ):
            continue
        reach = int(radius) + 2
        x0, x1 = max(0, int(x) - reach), min(width, int(x) + reach + 1)
        y0, y1 = max(0, int(y) - reach), min(height, int(y) + reach + 1)
        across = (np.arange(x0, x1)[None] + 0.5 - x) / radius
        down = (np.arange(y0, y1)[:, None] + 0.5 - y) / (radius * rng.uniform(0.9, 1.5))
        square = across**2 + down**2
        inside = np.clip((1 - square) * 4, 0, 1).astype(np.float32)
        bend = rng.uniform(3, 9) * radius
        window = slice(y0, y1), slice(x0, x1)
        dx[window] += inside * (-across * bend - 0 * down).astype(np.float32)
        dy[window] += inside * (-down * bend - 0 * across).astype(np.float32)
        cover[window] = np.maximum(cover[window], inside * (0.75 + 0.25 * np.clip(square, 0, 1)))
    columns, rows = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    soft = cv2.GaussianBlur(image, (0, 0), 0.004 * width)
    through = cv2.remap(soft, columns + dx, rows + dy, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    film = rain * rng.uniform(0, 0.5)
    image = image + np.float32(film) * (soft - image)
    return image + cover[..., None] * (through * np.float32(rng.uniform(0.8, 1.1)) - image)


def screen(rng: np.random.Generator, image: np.ndarray, veil: float) -> np.ndarray:
    """A veil of glare, dirt on the glass, and now and then the dashboard mirrored in it."""
    height, width = image.shape[:2]
    mean = np.percentile(image[::8, ::8], 90, axis=(0, 1)).astype(np.float32)
    x, y = np.meshgrid(
        np.linspace(-1, 1, width, dtype=np.float32), np.linspace(-1, 1, height, dtype=np.float32)
    )
    side, up = rng.uniform(-0.8, 0.8), rng.uniform(-1.2, 0.2)
    spread = np.exp(-((x - side) ** 2 + (y - up) ** 2) / rng.uniform(0.3, 1.5)).astype(np.float32)
    image = image + np.float32(veil) * (0.4 + spread)[..., None] * mean
    if rng.random() < 0.12:
        spread = noise(
            rng,
            (height, width),
            {max(2.0, 0.004 * width): 0.25, max(4.0, 0.015 * width): 0.3, width / 5: 0.6},
        )
        dirt = np.clip(spread - 0.7, 0, 1)[..., None]
        image = image + np.float32(rng.uniform(0.02, 0.1)) * dirt * (0.7 * mean - image)
    if rng.random() < 0.2:
        band = np.exp(-(((y - rng.uniform(0.3, 0.9) - 0.1 * x * rng.normal()) / rng.uniform(0.05, 0.3)) ** 2))
        image = image + np.float32(rng.uniform(0.01, 0.07)) * band[..., None] * mean
    return image
