"""Painted surfaces of the procedural street: facades, vehicles, clothes, leaves."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import UInt8

_WALLS = [(164, 108, 84), (196, 178, 146), (142, 148, 156), (178, 96, 82), (206, 200, 188), (126, 138, 120)]
_SIGNS = [(186, 44, 40), (28, 82, 150), (232, 190, 50), (34, 120, 70), (240, 240, 236), (90, 40, 110)]


Image = UInt8[np.ndarray, "h w 3"]
Colour = tuple[float, float, float]
"""Red, green and blue in 0..255."""


def noise(rng: np.random.Generator, shape: tuple[int, int], octaves: dict[float, float]) -> np.ndarray:
    """Smooth random field (H, W): a sum of octaves, cell size in texels -> standard deviation."""
    height, width = shape
    total = np.zeros(shape, dtype=np.float32)
    for cell, amplitude in octaves.items():
        grid = (max(2, round(height / cell) + 2), max(2, round(width / cell) + 2))
        values = rng.standard_normal(grid, dtype=np.float32)
        total += amplitude * cv2.resize(values, (width, height), interpolation=cv2.INTER_CUBIC)
    return total


def finished(image: np.ndarray) -> Image:
    """Colours in 0..255 as bytes."""
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def _flat(colour: Colour, shape: tuple[int, int]) -> np.ndarray:
    return np.full((*shape, 3), colour, dtype=np.float32)


def plain(rng: np.random.Generator, width_m: float, height_m: float, colour: Colour) -> Image:
    """A wall, roof or post of one colour with stains and grain."""
    shape = _shape(width_m, height_m, 0.04)
    return finished(_flat(colour, shape) + noise(rng, shape, {1: 4, 4: 6, 16: 7, 60: 9})[..., None])


def facade(rng: np.random.Generator, width_m: float, height_m: float, texel_m: float = 0.03) -> Image:
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
    return finished(image)


def _bricks(rng: np.random.Generator, image: np.ndarray, texel_m: float) -> None:
    course, length = max(3, round(0.12 / texel_m)), max(6, round(0.3 / texel_m))
    tone = rng.normal(0, 9, (image.shape[0] // course + 1, image.shape[1] // length + 2)).astype(np.float32)
    for row in range(tone.shape[0]):
        band = image[row * course : (row + 1) * course]
        shift = (row % 2) * length // 2
        band += np.repeat(tone[row], length)[shift : shift + band.shape[1]][None, :, None]
    image[::course] += 14


def write(
    image: np.ndarray, text: str, origin: tuple[int, int], scale: float, ink: Sequence[float], thick: int
) -> None:
    """Letters on colours in 0..255, in place; OpenCV writes on bytes only. The origin is bottom left."""
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
    write(image, letters, (12, top + board - 5), scale, [ink, ink, ink], 2)
    left = 8
    while left < width - 20:
        span = int(rng.uniform(24, 75))
        is_door = rng.random() < 0.3
        shade = rng.uniform(50, 150, 3) if is_door else rng.uniform(30, 90, 3)
        right = min(left + span, width - 8)
        bottom = height - (3 if is_door else int(0.14 * height_px))
        cv2.rectangle(image, (left, top + board + 6), (right, bottom), shade.tolist(), -1)
        cv2.rectangle(image, (left, top + board + 6), (right, bottom), (225.0, 222.0, 214.0), 1)
        for _ in range(0 if is_door else 6):
            spot = rng.uniform((left, top + board + 14), (right, bottom)).astype(int)
            corner = np.minimum(spot + rng.integers(3, 14, 2), (right, bottom))
            cv2.rectangle(image, spot.tolist(), corner.tolist(), rng.uniform(60, 250, 3).tolist(), -1)
        left = right + int(rng.uniform(4, 14))


def flank(rng: np.random.Generator, length_m: float, height_m: float, paint: Colour, print_: bool) -> Image:
    """The side of a vehicle below its windows: door seams, handles and, if printed, a stripe with letters."""
    shape = _shape(length_m, height_m, 0.015)
    image = _flat(paint, shape) + noise(rng, shape, {1: 2, 8: 3, 40: 5})[..., None]
    image += np.linspace(18, -22, shape[0], dtype=np.float32)[:, None, None]
    for fraction in (0.3, 0.52, 0.72):
        x = int(fraction * shape[1])
        cv2.line(image, (x, 0), (x, int(shape[0] * 0.9)), _dark(paint), 1)
        cv2.rectangle(image, (x - 12, int(shape[0] * 0.2)), (x - 4, int(shape[0] * 0.27)), _dark(paint), -1)
    if print_:
        _print(rng, image)
    image[int(0.88 * shape[0]) :] = 30
    return finished(image)


def _print(rng: np.random.Generator, image: np.ndarray) -> None:
    """Stripes and lettering in colours that differ from what is below."""
    height, width = image.shape[:2]
    below = image.mean()
    inks = [rng.uniform(150, 255, 3) if below < 120 else rng.uniform(10, 130, 3) for _ in range(2)]
    slope = rng.uniform(-0.2, 0.2) * height
    for offset in (0.3, 0.5):
        row = offset * height
        band = np.array([[0, row], [width, row + slope], [width, row + slope + 6], [0, row + 6]], np.int32)
        cv2.fillPoly(image, [band], inks[0].tolist())
    letters = "".join(rng.choice(list("ABCDEFGHIKLMNOPRSTUVXYZ"), int(rng.integers(4, 8))))
    at = (int(0.1 * width), int(0.8 * height))
    write(image, letters, at, height / 45, inks[1].tolist(), max(2, height // 30))
    for _ in range(3):
        centre = rng.uniform((0.5 * width, 0.1 * height), (0.95 * width, 0.8 * height)).astype(int)
        radius = int(rng.uniform(0.05, 0.2) * height)
        cv2.circle(image, centre.tolist(), radius, inks[1].tolist(), -1, cv2.LINE_AA)


def end(rng: np.random.Generator, width_m: float, height_m: float, paint: Colour, lamp: Colour) -> Image:
    """Front or back of a vehicle below its windows: lamps, a plate, a grille, a bumper."""
    height, width = shape = _shape(width_m, height_m, 0.015)
    image = _flat(paint, shape) + noise(rng, shape, {1: 2, 10: 4})[..., None]
    image += np.linspace(16, -20, height, dtype=np.float32)[:, None, None]

    def patch(x0: float, x1: float, y0: float, y1: float, colour: Colour) -> None:
        low, high = (int(x0 * width), int(y0 * height)), (int(x1 * width), int(y1 * height))
        cv2.rectangle(image, low, high, tuple(float(c) for c in colour), -1)

    for x in (0.03, 0.77):
        patch(x, x + 0.2, 0.2, 0.42, lamp)
    patch(0.28, 0.72, 0.25, 0.36, (30, 30, 34))
    patch(0.36, 0.64, 0.5, 0.66, (238, 238, 230))
    plate = "".join(rng.choice(list("ABCDEFHKLMNPRSTUVXYZ0123456789"), 6))
    write(image, plate, (int(0.38 * width), int(0.63 * height)), 0.28, [20, 20, 30], 1)
    patch(0.0, 1.0, 0.8, 1.0, (32, 32, 34))
    return finished(image)


def panel(rng: np.random.Generator, paint: Colour) -> Image:
    """Painted metal, almost even."""
    shape = (64, 64)
    return finished(_flat(paint, shape) + noise(rng, shape, {2: 2, 20: 4})[..., None])


def glass(rng: np.random.Generator, width_m: float, height_m: float) -> Image:
    """A row of windows between pillars."""
    shape = _shape(width_m, height_m, 0.02)
    image = _flat((38, 46, 54), shape) + noise(rng, shape, {6: 4, 30: 10})[..., None]
    image += np.linspace(26, -12, shape[0], dtype=np.float32)[:, None, None]
    for x in np.linspace(2, shape[1] - 3, max(2, round(width_m / 1.1) + 1)).astype(int):
        cv2.line(image, (int(x), 0), (int(x), shape[0]), (26, 26, 28), 4)
    cv2.rectangle(image, (0, 0), (shape[1] - 1, shape[0] - 1), (28, 28, 30), 2)
    return finished(image)


def wheel(rng: np.random.Generator) -> Image:
    """Tyre, rim and spokes, to be seen from the side."""
    image = _flat((26, 26, 28), (64, 64))
    cv2.circle(image, (32, 32), 20, (152, 154, 158), -1, cv2.LINE_AA)
    for spoke in np.arange(5) * 2 * np.pi / 5 + rng.uniform(0, 1):
        tip = 32 + 19 * np.cos(spoke), 32 + 19 * np.sin(spoke)
        cv2.line(image, (32, 32), (int(tip[0]), int(tip[1])), (58, 58, 62), 4, cv2.LINE_AA)
    return finished(image)


def cloth(rng: np.random.Generator, colour: Colour) -> Image:
    """Woven stuff: checks, stripes, or plain with folds."""
    shape = (48, 48)
    image = _flat(colour, shape) + noise(rng, shape, {2: 5, 12: 12})[..., None]
    kind, ink = rng.integers(3), rng.uniform(20, 240, 3).astype(np.float32)
    if kind != 2:
        image[(np.arange(48) // 6) % 2 == 0] = 0.4 * image[(np.arange(48) // 6) % 2 == 0] + 0.6 * ink
    if kind == 1:
        image[:, (np.arange(48) // 8) % 2 == 0] *= 0.7
    return finished(image)


def leaves(rng: np.random.Generator, colour: Colour) -> Image:
    """Foliage: spots of light and shade."""
    shape = (128, 128)
    spots = noise(rng, shape, {3: 0.5, 7: 0.5, 20: 0.35})
    return finished(np.array(colour, np.float32) * np.clip(0.9 + 0.45 * spots, 0.25, 1.9)[..., None])


def bark(rng: np.random.Generator) -> Image:
    """A trunk: upright furrows."""
    furrows = rng.normal(0, 22, (12, 64)).astype(np.float32)
    grain = cv2.resize(furrows, (64, 128), interpolation=cv2.INTER_CUBIC)
    return finished(_flat((98, 82, 66), (128, 64)) + grain[..., None])


def sign(rng: np.random.Generator) -> Image:
    """A traffic sign or a board: a frame, a field, letters."""
    image = _flat((240, 240, 236), (64, 64))
    ink = _SIGNS[int(rng.integers(len(_SIGNS)))]
    cv2.rectangle(image, (2, 2), (61, 61), tuple(float(c) for c in ink), 7)
    text = "".join(rng.choice(list("ABCEHKPRSTX0123456789"), 2))
    write(image, text, (13, 42), 0.9, [float(c) for c in ink], 2)
    return finished(image)


def _shape(width_m: float, height_m: float, texel_m: float) -> tuple[int, int]:
    return max(8, round(height_m / texel_m)), max(8, round(width_m / texel_m))


def _dark(paint: Colour) -> tuple[float, ...]:
    return tuple(0.35 * c for c in paint)
