"""Painted house fronts of many styles, by day and with some windows lit at night."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Float

from streetworld.edition2.roads.tiles import between
from streetworld.engine.paint import Image, finished, noise, write

TEXEL_M = 0.05
VARIANTS = 24
"""Painted fronts of each number of floors; a process paints each once."""


@dataclass(frozen=True)
class Facade:
    """A front: its colours, what shines at night, its width in metres, and what its roof is like."""

    image: Image
    glow: Image
    width_m: float
    style: str


@lru_cache(maxsize=200)
def facade(variant: int, floors: int) -> Facade:
    """A painted front of so many floors."""
    rng = np.random.default_rng([variant, floors, 71])
    high = floors >= 6
    names = ["plaster", "brick", "wood", "concrete", "glass", "shed"]
    shares = [0.25, 0.2, 0.02, 0.25, 0.26, 0.02] if high else [0.34, 0.24, 0.17, 0.1, 0.05, 0.1]
    style = str(rng.choice(names, p=shares))
    floor_m = {"glass": 3.6, "shed": 3.6}.get(style, float(rng.uniform(2.7, 3.4)))
    width_m = float(rng.uniform(6, 16))
    shape = round(floors * floor_m / TEXEL_M), round(width_m / TEXEL_M)
    paper = _Paper(rng, shape, floor_m / TEXEL_M)
    _STYLES[style](paper)
    if style in ("plaster", "brick", "concrete", "glass") and rng.random() < 0.45:
        _shops(paper)
    elif style != "shed":
        _entrance(paper)
    _stains(paper)
    # What is behind the glass shows in its light.
    glow = paper.glow * np.clip(0.35 + paper.image.mean(axis=-1, keepdims=True) / 160, 0.3, 1)
    return Facade(finished(paper.image), finished(glow), width_m, style)


class _Paper:
    """A front that is being painted: linear arrays of colours (H, W, 3) in 0..255."""

    def __init__(self, rng: np.random.Generator, shape: tuple[int, int], floor_px: float) -> None:
        self.rng, self.shape, self.floor_px = rng, shape, floor_px
        self.image = np.zeros((*shape, 3), np.float32)
        self.glow = np.zeros((*shape, 3), np.float32)

    @property
    def floors(self) -> int:
        return round(self.shape[0] / self.floor_px)

    def wash(self, colour: Float[np.ndarray, "3"], rough: float = 1.0) -> None:
        """Cover everything with a colour, unevenly."""
        field = noise(self.rng, self.shape, {1: 3 * rough, 5: 3 * rough, 30: 4, 120: 6})
        self.image[:] = colour + field[..., None]

    def rect(self, x0: float, y0: float, x1: float, y1: float, colour: object) -> None:
        """Fill a rectangle."""
        a, b, c, d = (max(0, round(v)) for v in (x0, y0, x1, y1))
        self.image[b:d, a:c] = np.asarray(colour, np.float32)

    def paste(self, patch: np.ndarray, x: float, y: float, glow: np.ndarray | None = None) -> None:
        """Lay a picture with its upper left corner somewhere."""
        a, b = round(x), round(y)
        if a < 0 or b < 0:
            return
        room = self.image[b : b + patch.shape[0], a : a + patch.shape[1]]
        room[:] = patch[: room.shape[0], : room.shape[1]]
        if glow is not None:
            self.glow[b : b + room.shape[0], a : a + room.shape[1]] = glow


def _plain_colour(rng: np.random.Generator) -> np.ndarray:
    """Mostly pale and warm, often grey, now and then of a strong colour."""
    level, warm = rng.uniform(110, 240), rng.uniform(0, 1)
    tint = np.array([1.0, 1 - 0.12 * warm, 1 - 0.38 * warm])
    if rng.random() < 0.3:
        tint = 1 + rng.normal(0, 0.03, 3)
    elif rng.random() < 0.15:
        tint = rng.uniform(0.55, 1.0, 3)
    return np.clip(level * tint, 20, 245)


def _strong(rng: np.random.Generator) -> np.ndarray:
    """A colour of signs and awnings."""
    mixed = rng.uniform(10, 250, 3)
    return mixed + rng.uniform(0.1, 0.9) * (mixed.mean() - mixed)


def _window(rng: np.random.Generator, size: tuple[int, int], frame: np.ndarray, bars: int) -> np.ndarray:
    """A window (H, W, 3): glass that mirrors sky above and street below, curtains, frame and bars."""
    height, width = size
    top, low = rng.uniform(40, 190), rng.uniform(15, 70)
    glass = np.linspace(top, low, height, dtype=np.float32)[:, None, None] * rng.uniform(
        (0.8, 0.9, 0.95), (1, 1.02, 1.15)
    )
    pane = np.repeat(glass, width, axis=1).astype(np.float32)
    if rng.random() < 0.5:
        cloth = rng.uniform(110, 235) * rng.uniform((0.85, 0.85, 0.8), (1, 1, 1))
        drawn = rng.random()
        if drawn < 0.4:
            pane[: int(height * rng.uniform(0.1, 0.9))] = 0.8 * cloth
        else:
            part = max(1, int(width * rng.uniform(0.1, 0.4)))
            pane[:, :part] = pane[:, -part:] = 0.75 * cloth
    pane[:2] = pane[-2:] = frame
    pane[:, :2] = pane[:, -2:] = frame
    for k in range(1, bars + 1):
        pane[:, k * width // (bars + 1)] = frame
    if rng.random() < 0.5:
        pane[int(height * rng.choice([0.3, 0.5]))] = frame
    return pane


def _rows(
    paper: _Paper,
    first: int,
    wide_m: tuple[float, float],
    high_m: tuple[float, float],
    pitch_m: tuple[float, float],
) -> None:
    """Windows on every floor from one on, equally spaced, of a few looks."""
    rng = paper.rng
    width, height = rng.uniform(*wide_m) / TEXEL_M, min(rng.uniform(*high_m) / TEXEL_M, 0.85 * paper.floor_px)
    pitch = max(width + 4, rng.uniform(*pitch_m) / TEXEL_M)
    count = max(1, int(paper.shape[1] // pitch))
    frame = np.full(3, float(rng.choice([240, 225, 60, 110]))) * rng.uniform((0.9, 0.88, 0.82), 1.0)
    bars, surround = int(rng.integers(0, 3)), rng.random()
    wall = paper.image.mean(axis=(0, 1))
    trim = np.clip(wall * rng.uniform(0.6, 1.4), 0, 250)
    shutters = (
        between(rng, (20, 40, 30), (150, 110, 110)) if rng.random() < 0.15 and pitch > 1.8 * width else None
    )
    looks = [_window(rng, (int(height), int(width)), frame, bars) for _ in range(5)]
    balcony = rng.random() < 0.25
    sill_px = 0.28 * paper.floor_px if height < 0.66 * paper.floor_px else 0.06 * paper.floor_px
    for floor in range(first, paper.floors):
        bottom = paper.shape[0] - floor * paper.floor_px - sill_px
        for k in range(count):
            x = (k + 0.5) * paper.shape[1] / count - width / 2
            y = bottom - height
            if y < 2:
                continue
            if surround < 0.45:
                paper.rect(x - 3, y - 3, x + width + 3, y + height + 3, trim)
            if shutters is not None:
                paper.rect(x - 0.5 * width, y, x - 2, y + height, shutters)
                paper.rect(x + width + 2, y, x + 1.5 * width, y + height, shutters)
            lit = rng.random() < 0.35
            glow = (
                rng.uniform(120, 255) * np.array([1.0, rng.uniform(0.65, 0.95), rng.uniform(0.3, 0.9)])
                if lit
                else None
            )
            paper.paste(looks[int(rng.integers(5))], x, y, glow)
            paper.rect(x - 3, y + height, x + width + 3, y + height + 2, np.minimum(wall * 1.25, 245))
            paper.rect(x - 3, y + height + 2, x + width + 3, y + height + 4, wall * 0.6)
        if balcony and floor % 2:
            paper.rect(0.1 * paper.shape[1], bottom + 2, 0.9 * paper.shape[1], bottom + 4, wall * 0.5)


def _plaster(paper: _Paper) -> None:
    rng = paper.rng
    colour = _plain_colour(rng)
    paper.wash(colour)
    if rng.random() < 0.4:  # a base of another colour
        paper.image[-int(0.25 * paper.floor_px) :] *= rng.uniform(0.5, 0.8)
    if rng.random() < 0.4:  # bands between the floors
        for floor in range(1, paper.floors + 1):
            y = paper.shape[0] - floor * paper.floor_px
            paper.rect(0, y - 2, paper.shape[1], y + 3, np.clip(colour * rng.uniform(0.7, 1.2), 0, 250))
    _rows(paper, 0, (0.8, 1.5), (1.2, 1.9), (1.8, 3.4))


def _brick(paper: _Paper) -> None:
    rng = paper.rng
    paper.wash(
        between(rng, (96, 50, 36), (200, 134, 104))
        if rng.random() < 0.75
        else between(rng, (140, 128, 110), (225, 215, 200))
    )
    course = max(2, round(rng.uniform(0.07, 0.14) / TEXEL_M))
    tone = rng.normal(0, 9, (paper.shape[0] // course + 1, paper.shape[1] // 5 + 2)).astype(np.float32)
    spread = np.kron(tone, np.ones((course, 5), np.float32))[: paper.shape[0], : paper.shape[1]]
    paper.image += spread[..., None]
    paper.image[::course] += rng.uniform(4, 18)
    _rows(paper, 0, (0.8, 1.5), (1.2, 1.9), (1.8, 3.4))


def _wood(paper: _Paper) -> None:
    rng = paper.rng
    paper.wash(_plain_colour(rng), 0.7)
    board = max(3, round(rng.uniform(0.14, 0.3) / TEXEL_M))
    if rng.random() < 0.7:
        paper.image[::board] *= 0.78
        paper.image[1::board] *= 1.04
    else:
        paper.image[:, ::board] *= 0.8
    _rows(paper, 0, (0.8, 1.7), (1.0, 1.6), (2.2, 4.2))


def _concrete(paper: _Paper) -> None:
    rng = paper.rng
    paper.wash(np.full(3, rng.uniform(110, 215)) + rng.normal(0, 8, 3))
    if rng.random() < 0.6:  # ribbons of windows
        high, sill = rng.uniform(0.4, 0.6) * paper.floor_px, 0.3 * paper.floor_px
        for floor in range(paper.floors):
            y = paper.shape[0] - (floor + 1) * paper.floor_px + (paper.floor_px - sill - high)
            band = _window(
                rng, (int(high), paper.shape[1]), np.full(3, rng.uniform(40, 200)), int(paper.shape[1] // 30)
            )
            paper.paste(band, 0, y)
            for start in np.flatnonzero(rng.random(paper.shape[1] // 30) < 0.3) * 30:
                paper.glow[int(y) : int(y + high), start : start + 28] = (235, 215, 170)
    else:
        _rows(paper, 0, (1.2, 2.6), (1.2, 1.6), (2.8, 4.2))
        step = int(paper.floor_px)
        paper.image[step - 1 :: step] *= 0.7
    if rng.random() < 0.35:  # balconies
        wide, colour = rng.uniform(2.2, 4) / TEXEL_M, _plain_colour(rng)
        for floor in range(1, paper.floors):
            y = paper.shape[0] - floor * paper.floor_px
            for x in np.arange(0.1 * paper.shape[1], paper.shape[1] - wide, 1.6 * wide):
                paper.rect(x, y - 22, x + wide, y, colour * 0.9)
                paper.rect(x, y, x + wide, y + 5, colour * 0.4)


def _glass(paper: _Paper) -> None:
    rng = paper.rng
    tint = rng.uniform((0.6, 0.75, 0.8), (1.0, 1.05, 1.25))
    cells = (
        paper.shape[0] // max(4, int(paper.floor_px / 2)) + 1,
        paper.shape[1] // int(rng.uniform(18, 36)) + 1,
    )
    panes = rng.normal(0, 14, cells).astype(np.float32)
    tone = cv2.resize(panes, (paper.shape[1], paper.shape[0]), interpolation=cv2.INTER_NEAREST)
    slope = np.linspace(rng.uniform(90, 190), rng.uniform(40, 90), paper.shape[0], dtype=np.float32)[:, None]
    cloud = noise(rng, paper.shape, {40: 10, 120: 16})
    paper.image[:] = np.clip(slope + tone + cloud, 12, 240)[..., None] * tint
    bar = np.full(3, float(rng.choice([40, 90, 170, 215])))
    for k in range(cells[0]):
        paper.image[min(paper.shape[0] - 1, k * paper.shape[0] // cells[0])] = bar
    for k in range(cells[1]):
        paper.image[:, min(paper.shape[1] - 1, k * paper.shape[1] // cells[1])] = bar
    lit = cv2.resize(
        (rng.random(cells) < 0.3).astype(np.float32),
        (paper.shape[1], paper.shape[0]),
        interpolation=cv2.INTER_NEAREST,
    )
    paper.glow[:] = lit[..., None] * np.array([225, 220, 200], np.float32)


def _shed(paper: _Paper) -> None:
    """A hall or garage: ribs of metal, wide gates."""
    rng = paper.rng
    paper.wash(_plain_colour(rng), 0.6)
    ribs = max(3, round(rng.uniform(0.2, 0.5) / TEXEL_M))
    paper.image[:, ::ribs] *= 0.82
    x = rng.uniform(0.5, 2) / TEXEL_M
    while x < paper.shape[1] - 60:
        wide, high = rng.uniform(2.4, 4) / TEXEL_M, min(rng.uniform(2.2, 3.2) / TEXEL_M, 0.9 * paper.floor_px)
        gate = _plain_colour(rng)
        paper.rect(x, paper.shape[0] - high, x + wide, paper.shape[0], gate)
        for y in np.arange(paper.shape[0] - high, paper.shape[0], 9):
            paper.rect(x, y, x + wide, y + 1, gate * 0.75)
        x += wide + rng.uniform(1, 5) / TEXEL_M


_STYLES: dict[str, Callable[[_Paper], None]] = {
    "plaster": _plaster,
    "brick": _brick,
    "wood": _wood,
    "concrete": _concrete,
    "glass": _glass,
    "shed": _shed,
}


def _shops(paper: _Paper) -> None:
    """The ground floor as shops: signs, panes with goods, doors, awnings."""
    rng, height = paper.rng, paper.shape[0]
    top = int(height - min(paper.floor_px * 1.1, 80))
    x = 0.0
    while x < paper.shape[1] - 20:
        wide = min(rng.uniform(2.5, 7) / TEXEL_M, paper.shape[1] - x)
        frame, board = between(rng, (22, 22, 24), (205, 200, 192)), _strong(rng)
        paper.rect(x, top, x + wide, height, frame)
        pane = rng.uniform(20, 110) * rng.uniform((0.8, 0.85, 0.9), 1.1)
        paper.rect(x + 4, top + 18, x + wide - 4, height - rng.uniform(2, 12), pane)
        for _ in range(int(wide / 8)):
            a, b = x + rng.uniform(6, max(7, wide - 12)), top + rng.uniform(22, max(23, height - top - 16))
            paper.rect(
                a,
                b,
                min(a + rng.uniform(2, 14), x + wide - 5),
                min(b + rng.uniform(2, 16), height - 8),
                rng.uniform(30, 240, 3),
            )
        paper.rect(x, top, x + wide, top + 15, board)
        text = "".join(rng.choice(list("ABCDEFGHIKLMNOPRSTUVXYZ"), max(3, int(wide // 14))))
        ink = [245.0] * 3 if board.mean() < 130 else [20.0] * 3
        write(paper.image, text, (int(x + 5), top + 12), 0.42, ink, 1)
        if rng.random() < 0.7:
            paper.glow[top + 1 : top + 14, int(x + 1) : int(x + wide - 1)] = np.clip(board * 1.2 + 40, 0, 255)
            paper.glow[top + 18 : height - 8, int(x + 4) : int(x + wide - 4)] = rng.uniform(
                90, 230
            ) * np.array([1, 0.9, 0.7])
        door = x + rng.uniform(4, max(5, wide - 24))
        paper.rect(door, top + 22, door + 18, height, between(rng, (18, 18, 20), (150, 140, 128)))
        if rng.random() < 0.3:
            cloth, stripe = _strong(rng), rng.random() < 0.5
            paper.rect(x, top + 15, x + wide, top + 32, cloth)
            if stripe:
                for s in np.arange(x, x + wide, 10):
                    paper.rect(s, top + 15, s + 5, top + 32, (235, 235, 228))
        x += wide


def _entrance(paper: _Paper) -> None:
    """A door or two, perhaps a garage."""
    rng, height = paper.rng, paper.shape[0]
    for _ in range(int(rng.integers(1, 3))):
        wide = rng.uniform(0.9, 1.3) / TEXEL_M if rng.random() < 0.7 else rng.uniform(2.3, 3) / TEXEL_M
        high = min(2.2 / TEXEL_M, 0.85 * paper.floor_px)
        x = rng.uniform(0, max(1.0, paper.shape[1] - wide))
        colour = between(rng, (25, 20, 18), (190, 180, 175))
        paper.rect(x - 2, height - high - 2, x + wide + 2, height, np.minimum(colour + 60, 240))
        paper.rect(x, height - high, x + wide, height, colour)
        for y in np.arange(height - high + 6, height, 10):
            paper.rect(x + 2, y, x + wide - 2, y + 1, colour * 0.7)
        paper.glow[int(height - high) : height, int(x) : int(x + wide)] = 0


def _stains(paper: _Paper) -> None:
    """Streaks below sills, darker feet, scribbles."""
    rng = paper.rng
    if rng.random() < 0.6:
        streaks = noise(rng, (4, paper.shape[1]), {1: 0.03, 6: 0.05}).mean(axis=0)
        paper.image *= (1 + streaks * rng.uniform(0.3, 1.2))[None, :, None]
    foot = np.linspace(0, 1, paper.shape[0], dtype=np.float32)[:, None, None] ** 12
    paper.image *= 1 - rng.uniform(0, 0.4) * foot
    if rng.random() < 0.12:
        for _ in range(int(rng.integers(1, 5))):
            points = (
                np.cumsum(rng.normal(0, 6, (14, 2)), axis=0)
                + rng.uniform((0, -40), (paper.shape[1], -14))
                + [0, paper.shape[0]]
            )
            cv2.polylines(
                paper.image, [points.astype(np.int32)], False, rng.uniform(0, 255, 3).tolist(), 2, cv2.LINE_AA
            )
