"""Painted surfaces of the procedural street: asphalt, paving, facades, vehicles, sky."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float, UInt8

_WALLS = [(164, 108, 84), (196, 178, 146), (142, 148, 156), (178, 96, 82), (206, 200, 188), (126, 138, 120)]
_PAINTS = [(168, 32, 36), (36, 70, 140), (196, 198, 202), (44, 48, 54), (212, 170, 60), (40, 110, 84)]
_SIGNS = [(186, 44, 40), (28, 82, 150), (232, 190, 50), (34, 120, 70), (240, 240, 236), (90, 40, 110)]


@dataclass(frozen=True)
class Texture:
    """An image stretched over a rectangle, with its halved copies for distant views.

    Attributes:
        image: RGB (H, W, 3).
    """

    image: UInt8[np.ndarray, "h w 3"]

    @cached_property
    def levels(self) -> list[np.ndarray]:
        """The image, then each half the size of the one before, down to 2 texels."""
        levels = [self.image]
        while min(levels[-1].shape[:2]) >= 4:
            height, width = levels[-1].shape[:2]
            levels.append(cv2.resize(levels[-1], (width // 2, height // 2), interpolation=cv2.INTER_AREA))
        return levels


def noise(rng: np.random.Generator, shape: tuple[int, int], octaves: dict[float, float]) -> np.ndarray:
    """Smooth random field (H, W): a sum of octaves, cell size in texels -> standard deviation."""
    height, width = shape
    total = np.zeros(shape, dtype=np.float32)
    for cell, amplitude in octaves.items():
        grid = (max(2, round(height / cell) + 2), max(2, round(width / cell) + 2))
        values = rng.standard_normal(grid, dtype=np.float32)
        total += amplitude * cv2.resize(values, (width, height), interpolation=cv2.INTER_CUBIC)
    return total


def _texture(image: np.ndarray) -> Texture:
    return Texture(np.clip(np.rint(image), 0, 255).astype(np.uint8))


def _flat(colour: tuple[int, int, int], shape: tuple[int, int]) -> np.ndarray:
    return np.full((*shape, 3), colour, dtype=np.float32)


def plain(
    rng: np.random.Generator,
    width_m: float,
    height_m: float,
    colour: tuple[int, int, int],
    texel_m: float = 0.04,
) -> Texture:
    """A wall, roof or post of one colour with stains and grain."""
    shape = max(8, round(height_m / texel_m)), max(8, round(width_m / texel_m))
    return _texture(_flat(colour, shape) + noise(rng, shape, {1: 4, 4: 6, 16: 7, 60: 9})[..., None])


def road(rng: np.random.Generator, width_m: float, length_m: float, texel_m: float) -> Texture:
    """Asphalt (rows along the road) with lane markings, patches, cracks, manholes and crossings."""
    shape = round(length_m / texel_m), round(width_m / texel_m)
    image = _flat((96, 96, 99), shape) + noise(rng, shape, {1: 6, 3: 8, 12: 7, 50: 6, 200: 7})[..., None]
    for _ in range(round(length_m / 5)):
        _patch(rng, image, texel_m)
    for _ in range(round(length_m / 2.5)):
        _crack(rng, image)
    for _ in range(round(length_m / 9)):
        _manhole(rng, image, texel_m)
    paint = _markings(rng, shape, texel_m)
    worn = np.clip(0.75 + noise(rng, shape, {2: 0.12, 10: 0.14, 60: 0.12}), 0, 1) * paint
    return _texture(image + worn[..., None] * (np.array([226, 226, 220], np.float32) - image))


def _patch(rng: np.random.Generator, image: np.ndarray, texel_m: float) -> None:
    """A repaired rectangle, darker or lighter, with a sealed seam."""
    height, width = (rng.uniform(0.5, 3.0, 2) / texel_m).astype(int)
    top, left = (int(rng.integers(0, max(1, image.shape[i] - s))) for i, s in ((0, height), (1, width)))
    region = image[top : top + height, left : left + width]
    region += rng.uniform(-24, 18)
    shade = float(rng.uniform(40, 70))
    cv2.rectangle(image, (left, top), (left + int(width), top + int(height)), (shade, shade, shade), 1)


def _crack(rng: np.random.Generator, image: np.ndarray) -> None:
    start = rng.uniform((0, 0), (image.shape[1], image.shape[0]))
    heading = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.normal(0, 0.5, 24))
    path = start + np.cumsum(np.stack([np.cos(heading), np.sin(heading)], -1) * rng.uniform(2, 6), axis=0)
    shade = float(rng.uniform(35, 60))
    cv2.polylines(image, [path.astype(np.int32)], False, (shade, shade, shade), 1, cv2.LINE_AA)


def _manhole(rng: np.random.Generator, image: np.ndarray, texel_m: float) -> None:
    centre = (int(rng.integers(0, image.shape[1])), int(rng.integers(0, image.shape[0])))
    radius = round(0.35 / texel_m)
    cv2.circle(image, centre, radius, (58, 56, 54), -1, cv2.LINE_AA)
    cv2.circle(image, centre, radius, (128, 124, 118), 1, cv2.LINE_AA)
    for offset in range(-radius // 2, radius // 2 + 1, max(2, radius // 4)):
        row = centre[1] + offset
        cv2.line(image, (centre[0] - radius // 2, row), (centre[0] + radius // 2, row), (110, 108, 104), 1)


def _markings(rng: np.random.Generator, shape: tuple[int, int], texel_m: float) -> np.ndarray:
    """Coverage of paint (H, W) in [0, 1]: dashed centre line, parking lines, crossings, arrows."""
    paint = np.zeros(shape, dtype=np.float32)
    rows_m, centre = np.arange(shape[0]) * texel_m, shape[1] / 2

    def band(x_m: float, width_m: float) -> slice:
        return slice(
            round(centre + (x_m - width_m / 2) / texel_m), round(centre + (x_m + width_m / 2) / texel_m)
        )

    paint[(rows_m % 6.0) < 3.0, band(0, 0.15)] = 1
    for side in (-1, 1):
        paint[:, band(side * 3.75, 0.12)] = 1
        paint[(rows_m % 5.6) < 0.12, band(side * 4.85, 2.2)] = 1
    for z_m in np.arange(rng.uniform(24, 32), rows_m[-1] - 4, 38.0):
        crossing = (rows_m > z_m) & (rows_m < z_m + 2.6)
        for x_m in np.arange(-3.3, 3.4, 1.1):
            paint[crossing, band(x_m, 0.55)] = 1
    return paint


def paving(rng: np.random.Generator, width_m: float, length_m: float, texel_m: float) -> Texture:
    """Sidewalk slabs of uneven brightness with dark joints and spots (rows along the street)."""
    shape = round(length_m / texel_m), round(width_m / texel_m)
    slab = max(4, round(0.6 / texel_m))
    tiles = rng.normal(0, 9, (shape[0] // slab + 1, shape[1] // slab + 1)).astype(np.float32)
    image = _flat((158, 152, 142), shape) + noise(rng, shape, {1: 5, 5: 6, 30: 7})[..., None]
    image += np.kron(tiles, np.ones((slab, slab), np.float32))[: shape[0], : shape[1], None]
    image[::slab] -= 38
    image[:, ::slab] -= 38
    for _ in range(shape[0] // 12):
        spot = (int(rng.integers(0, shape[1])), int(rng.integers(0, shape[0])))
        shade = float(rng.uniform(70, 120))
        cv2.circle(image, spot, int(rng.integers(1, 4)), (shade, shade, shade), -1, cv2.LINE_AA)
    return _texture(image)


def facade(rng: np.random.Generator, width_m: float, height_m: float, texel_m: float = 0.03) -> Texture:
    """A house front: brick or plaster, rows of differing windows, a shop with a lettered sign below."""
    shape = round(height_m / texel_m), round(width_m / texel_m)
    colour = _WALLS[int(rng.integers(len(_WALLS)))]
    image = _flat(colour, shape) + noise(rng, shape, {1: 5, 4: 7, 20: 7, 90: 10})[..., None]
    if rng.random() < 0.5:
        _bricks(rng, image, texel_m)
    floor_m, shop_m = float(rng.uniform(2.7, 3.2)), 3.4
    window_m = np.array([rng.uniform(0.9, 1.5), rng.uniform(1.3, 1.8)])
    columns = max(1, int(width_m / rng.uniform(1.9, 2.8)))
    for sill_m in np.arange(shop_m + 0.7, height_m - window_m[1] - 0.3, floor_m):
        for column in range(columns):
            left_m = (column + 0.5) * width_m / columns - window_m[0] / 2
            top_m = height_m - sill_m - window_m[1]
            _window(rng, image, np.array([left_m, top_m]) / texel_m, window_m / texel_m)
    _shop(rng, image, shop_m / texel_m)
    return _texture(image)


def _bricks(rng: np.random.Generator, image: np.ndarray, texel_m: float) -> None:
    course, length = max(3, round(0.12 / texel_m)), max(6, round(0.3 / texel_m))
    tone = rng.normal(0, 9, (image.shape[0] // course + 1, image.shape[1] // length + 2)).astype(np.float32)
    for row in range(tone.shape[0]):
        band = image[row * course : (row + 1) * course]
        shift = (row % 2) * length // 2
        band += np.repeat(tone[row], length)[shift : shift + band.shape[1]][None, :, None]
    image[::course] += 14


def _write(
    image: np.ndarray, text: str, origin: tuple[int, int], scale: float, ink: list[float], thick: int
) -> None:
    """Letters on a float image; OpenCV writes on bytes only."""
    mask = np.zeros(image.shape[:2], dtype=np.uint8)
    cv2.putText(mask, text, origin, cv2.FONT_HERSHEY_DUPLEX, scale, (255,), thick, cv2.LINE_AA)
    image += (mask[..., None] / np.float32(255)) * (np.array(ink, np.float32) - image)


def _window(rng: np.random.Generator, image: np.ndarray, corner: np.ndarray, size: np.ndarray) -> None:
    x0, y0 = (int(v) for v in corner)
    x1, y1 = (int(v) for v in corner + size)
    frame = float(rng.choice([236, 210, 70]))
    cv2.rectangle(image, (x0 - 2, y0 - 2), (x1 + 2, y1 + 2), (frame, frame, frame), -1)
    glass = np.linspace(rng.uniform(70, 150), rng.uniform(25, 60), max(1, y1 - y0), dtype=np.float32)
    pane = image[y0:y1, x0:x1]
    pane[:] = glass[: len(pane), None, None] * np.array([0.86, 0.98, 1.12], np.float32)
    if rng.random() < 0.6:
        cloth = rng.uniform(120, 235, 3).astype(np.float32)
        drawn = int((y1 - y0) * rng.uniform(0.15, 0.8))
        pane[:drawn] = cloth + 12 * np.sin(np.arange(pane.shape[1]) * rng.uniform(0.5, 1.2))[None, :, None]
    middle = (x0 + x1) // 2
    cv2.line(image, (middle, y0), (middle, y1), (frame, frame, frame), 1)
    cv2.line(image, (x0, y0 + (y1 - y0) // 3), (x1, y0 + (y1 - y0) // 3), (frame, frame, frame), 1)
    cv2.line(image, (x0 - 4, y1 + 3), (x1 + 4, y1 + 3), (200, 196, 188), 2)


def _shop(rng: np.random.Generator, image: np.ndarray, height_px: float) -> None:
    height, width = image.shape[:2]
    top = int(height - height_px)
    sign = _SIGNS[int(rng.integers(len(_SIGNS)))]
    board = int(0.18 * height_px)
    cv2.rectangle(image, (4, top), (width - 5, top + board), tuple(float(c) for c in sign), -1)
    letters = "".join(rng.choice(list("ABCDEFGHIKLMNOPRSTUVXYZ"), max(3, width // 45)))
    ink = 250.0 if sum(sign) < 420 else 30.0
    scale = board / 30
    _write(image, letters, (12, top + board - 5), scale, [ink, ink, ink], 2)
    left = 8
    while left < width - 20:
        span = int(rng.uniform(24, 75))
        is_door = rng.random() < 0.3
        shade = rng.uniform(30, 90, 3) if not is_door else rng.uniform(50, 150, 3)
        right = min(left + span, width - 8)
        bottom = height - (3 if is_door else int(0.14 * height_px))
        cv2.rectangle(image, (left, top + board + 6), (right, bottom), shade.tolist(), -1)
        cv2.rectangle(image, (left, top + board + 6), (right, bottom), (225.0, 222.0, 214.0), 1)
        for _ in range(0 if is_door else 6):
            spot = rng.uniform((left, top + board + 14), (right, bottom)).astype(int)
            corner = np.minimum(spot + rng.integers(3, 14, 2), (right, bottom))
            cv2.rectangle(image, spot.tolist(), corner.tolist(), rng.uniform(60, 250, 3).tolist(), -1)
        left = right + int(rng.uniform(4, 14))


def vehicle_paint(rng: np.random.Generator) -> tuple[int, int, int]:
    """The colour of a car."""
    return _PAINTS[int(rng.integers(len(_PAINTS)))]


def vehicle_side(
    rng: np.random.Generator,
    length_m: float,
    height_m: float,
    paint: tuple[int, int, int],
    texel_m: float = 0.012,
) -> Texture:
    """The flank of a vehicle: paint, door seams, a stripe, lettering, wheels."""
    shape = round(height_m / texel_m), round(length_m / texel_m)
    image = _flat(paint, shape) + noise(rng, shape, {1: 3, 8: 4, 40: 7})[..., None]
    image += np.linspace(26, -26, shape[0], dtype=np.float32)[:, None, None]
    for fraction in (0.24, 0.46, 0.68):
        x = int(fraction * shape[1])
        cv2.line(image, (x, 2), (x, int(shape[0] * 0.85)), (20, 20, 22), 1)
        cv2.rectangle(
            image, (x + 6, int(shape[0] * 0.2)), (x + 16, int(shape[0] * 0.26)), (225, 225, 225), -1
        )
    stripe = rng.uniform(40, 240, 3).tolist()
    cv2.line(image, (0, int(shape[0] * 0.5)), (shape[1], int(shape[0] * 0.42)), stripe, 4)
    text = "".join(rng.choice(list("ACDEHKMNRTX0123456789"), 5))
    _write(image, text, (shape[1] // 3, int(shape[0] * 0.7)), 0.8, stripe, 2)
    image[int(shape[0] * 0.86) :] = 24
    radius = round(0.33 / texel_m)
    for x in (0.18, 0.82):
        hub = (int(x * shape[1]), shape[0] - radius)
        cv2.circle(image, hub, radius, (22, 22, 24), -1, cv2.LINE_AA)
        cv2.circle(image, hub, radius * 6 // 10, (150, 152, 156), -1, cv2.LINE_AA)
        for spoke in np.arange(5) * 2 * np.pi / 5 + rng.uniform(0, 1):
            tip = hub[0] + 0.6 * radius * np.cos(spoke), hub[1] + 0.6 * radius * np.sin(spoke)
            cv2.line(image, hub, (int(tip[0]), int(tip[1])), (60, 60, 64), 2, cv2.LINE_AA)
    return _texture(image)


def vehicle_end(
    rng: np.random.Generator,
    width_m: float,
    height_m: float,
    paint: tuple[int, int, int],
    lamp: tuple[int, int, int],
    texel_m: float = 0.012,
) -> Texture:
    """Front or back of a vehicle: lamps, a number plate, a bumper, a grille."""
    height, width = round(height_m / texel_m), round(width_m / texel_m)
    image = _flat(paint, (height, width)) + noise(rng, (height, width), {1: 3, 10: 5})[..., None]
    image += np.linspace(24, -20, height, dtype=np.float32)[:, None, None]
    for x in (0.03, 0.77):
        low, high = (int(x * width), int(0.22 * height)), (int((x + 0.2) * width), int(0.42 * height))
        cv2.rectangle(image, low, high, tuple(float(c) for c in lamp), -1)
        cv2.rectangle(image, low, high, (240, 236, 230), 1)
    cv2.rectangle(
        image,
        (int(0.28 * width), int(0.25 * height)),
        (int(0.72 * width), int(0.34 * height)),
        (30, 30, 34),
        -1,
    )
    plate = (int(0.34 * width), int(0.46 * height)), (int(0.66 * width), int(0.6 * height))
    cv2.rectangle(image, *plate, (240, 240, 232), -1)
    text = "".join(rng.choice(list("ABCDEFHKLMNPRSTUVXYZ0123456789"), 6))
    _write(image, text, (plate[0][0] + 2, plate[1][1] - 3), 0.36, [20, 20, 30], 1)
    cv2.line(image, (0, int(0.68 * height)), (width, int(0.68 * height)), (30, 30, 32), 2)
    image[int(0.84 * height) :] = 26
    return _texture(image)


def vehicle_glass(
    rng: np.random.Generator, width_m: float, height_m: float, texel_m: float = 0.012
) -> Texture:
    """Windows of the cabin between bright pillars, with reflections."""
    shape = round(height_m / texel_m), round(width_m / texel_m)
    image = _flat((58, 70, 82), shape) + noise(rng, shape, {6: 8, 30: 22})[..., None]
    image += np.linspace(46, -26, shape[0], dtype=np.float32)[:, None, None]
    pillars = max(2, round(width_m / 0.9) + 1)
    for x in np.linspace(3, shape[1] - 4, pillars).astype(int):
        cv2.line(image, (int(x), 0), (int(x), shape[0]), (40, 40, 44), 5)
    cv2.rectangle(image, (0, 0), (shape[1] - 1, shape[0] - 1), (48, 48, 52), 3)
    return _texture(image)


def sky_panorama(rng: np.random.Generator) -> Float[np.ndarray, "h w 3"]:
    """Clouds over a gradient: rows from the zenith down to the horizon, columns a full turn."""
    shape = (180, 720)
    up = np.linspace(1, 0, shape[0], dtype=np.float32)[:, None, None]
    blue = np.array([96, 150, 214], np.float32) * up**0.5 + np.array([214, 226, 238], np.float32) * (
        1 - up**0.5
    )
    cloud = np.clip(noise(rng, shape, {8: 0.12, 25: 0.25, 80: 0.4}) + 0.1, 0, 1)[..., None]
    return (blue + 0.7 * cloud * (np.array([246, 246, 248], np.float32) - blue)).astype(np.float32)
