"""Loads of trucks: boxes, curtains, tanks, beds, tippers, containers, drums."""

import numpy as np

from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.layouts.variants import Colour, Draw
from streetworld.edition2.vehicles.parts.canvas import Canvas, lettering
from streetworld.edition2.vehicles.parts.loft import ViewSide, loft, projected, smooth
from streetworld.edition2.vehicles.parts.trim import shaded
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh, box, frustum

CARGO = (
    "box",
    "box",
    "box",
    "curtain",
    "flatbed",
    "tipper",
    "tank",
    "container",
    "semi box",
    "semi curtain",
    "semi tank",
    "semi container",
    "mixer",
    "refuse",
    "ribbed",
)
"""By their shares; the last three are those of looks kept out."""

_COLOURS: tuple[Colour, ...] = (
    (232, 232, 230),
    (232, 232, 230),
    (228, 226, 218),
    (180, 30, 34),
    (30, 72, 150),
    (222, 172, 40),
    (40, 104, 66),
    (206, 98, 36),
    (120, 124, 128),
    (24, 26, 30),
    (110, 52, 44),
)
_BLACK: Colour = (20, 20, 22)


class Load:
    """The rear of a truck: between two places along x, to a width and a height, above a frame."""

    def __init__(
        self,
        draw: Draw,
        cargo: str,
        along_m: tuple[float, float],
        width_m: float,
        height_m: float,
        floor_m: float,
    ) -> None:
        self._draw, self._cargo = draw, cargo.removeprefix("semi ")
        self._back, self._front = along_m
        self._length, self._width = self._front - self._back, width_m
        self._height, self._floor = height_m, floor_m
        self._colour = draw.near(draw.any_of(_COLOURS), 8)

    def meshes(self, materials: Materials) -> list[Mesh]:
        """Its triangles."""
        build = {"flatbed": self._flatbed, "tipper": self._tipper, "tank": self._tank, "mixer": self._mixer}
        shell, top = build.get(self._cargo, self._box)()
        size = (self._length, self._width, self._height)
        paints = [materials.add(i, Semantic.TRUCK, gloss=0.04) for i in self._pictures(top)]
        middle = np.eye(4)
        middle[0, 3] = 0.5 * (self._back + self._front)
        return [projected(smooth(shell), size, paints).moved(middle), self._bar(materials)]

    def _box(self) -> tuple[Mesh, float]:
        half, side = 0.5 * self._length, 0.5 * self._width
        top = self._height
        shown = (half - 0.02, side - 0.02)
        edge = (-shown[0], shown[0], -shown[1], shown[1])
        full = (-half, half, -side, side)
        faces = [ViewSide.LEFT, ViewSide.RIGHT, ViewSide.BACK, ViewSide.FRONT, ViewSide.TOP, ViewSide.UNDER]
        walls = frustum(full, full, (self._floor, top - 0.03), [*faces[:4], None, faces[5]])
        return Mesh.joined([walls, frustum(full, edge, (top - 0.03, top), [*faces[:5], None])]), top

    def _flatbed(self) -> tuple[Mesh, float]:
        half, side, rng = 0.5 * self._length, 0.5 * self._width, self._draw.rng
        top = self._floor + float(rng.uniform(0.12, 0.55))
        faces = [ViewSide.LEFT, ViewSide.RIGHT, ViewSide.BACK, ViewSide.FRONT, ViewSide.UNDER, ViewSide.UNDER]
        full = (-half, half, -side, side)
        made = [frustum(full, full, (self._floor - 0.05, top), faces)]
        made.append(
            box(
                (half - 0.04, 0, 0.5 * (top + 0.8 * self._height)),
                (0.06, 1.8 * side, 0.8 * self._height - top),
                ViewSide.UNDER,
            )
        )
        for _ in range(int(rng.integers(0, 6))):
            size = rng.uniform((0.5, 0.4, 0.2), (2.0, 1.6 * side, max(0.3, 0.85 * self._height - top)))
            size[:2] = np.minimum(size[:2], [self._length - 0.4, 2 * side - 0.2])
            x, y = rng.uniform(-1, 1, 2) * (np.array([half - 0.1, side - 0.05]) - 0.5 * size[:2])
            made.append(
                box(
                    (x, y, top + 0.5 * size[2]),
                    size.tolist(),
                    [
                        ViewSide.LEFT,
                        ViewSide.RIGHT,
                        ViewSide.BACK,
                        ViewSide.FRONT,
                        ViewSide.TOP,
                        ViewSide.UNDER,
                    ],
                )
            )
        return Mesh.joined(made), top

    def _tipper(self) -> tuple[Mesh, float]:
        half, side = 0.5 * self._length, 0.5 * self._width
        top = min(self._height - 0.1, self._floor + float(self._draw.rng.uniform(0.7, 1.3)))
        low = (-half + 0.1, half, 0.12 - side, side - 0.12)
        full = (-half, half, -side, side)
        faces = [ViewSide.LEFT, ViewSide.RIGHT, ViewSide.BACK, ViewSide.FRONT, ViewSide.UNDER, ViewSide.UNDER]
        tub = frustum(low, full, (self._floor, top), faces)
        heap = frustum(
            (0.3 - half, half - 0.2, 0.2 - side, side - 0.2),
            (-0.5 * half, 0.4 * half, -0.2, 0.2),
            (top, self._height),
            [ViewSide.TOP] * 6,
        )
        rail = box((half - 0.3, 0, top + 0.04), (0.9, 2 * side, 0.08), ViewSide.RIGHT)
        return Mesh.joined([tub, heap, rail] if self._draw.chance(0.6) else [tub, rail]), top

    def _tank(self) -> tuple[Mesh, float]:
        half = 0.5 * self._length
        middle, rise = 0.5 * (self._floor + self._height) - 0.04, 0.5 * (self._height - self._floor) - 0.06
        turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
        faces = np.where(
            np.abs(np.sin(turn + np.pi / 16)) > 0.9,
            ViewSide.TOP,
            np.where(np.cos(turn + np.pi / 16) > 0, ViewSide.RIGHT, ViewSide.LEFT),
        )
        stations = [
            (-half, 0.0),
            (-half, 0.82),
            (-half + 0.12, 1.0),
            (half - 0.12, 1.0),
            (half, 0.82),
            (half, 0.0),
        ]
        rings = np.stack(
            [
                np.stack(
                    [np.full(16, x), -r * 0.5 * self._width * np.cos(turn), middle + r * rise * np.sin(turn)],
                    -1,
                )
                for x, r in stations
            ]
        )
        kinds = np.stack(
            [
                np.full(16, ViewSide.BACK),
                np.full(16, ViewSide.BACK),
                faces,
                np.full(16, ViewSide.FRONT),
                np.full(16, ViewSide.FRONT),
            ]
        )
        walk = box((0, 0, self._height - 0.04), (0.7 * self._length, 0.5, 0.08), ViewSide.UNDER)
        bed = box((0, 0, self._floor), (self._length - 0.2, 0.8 * self._width, 0.16), ViewSide.UNDER)
        return Mesh.joined([loft(rings[:, ::-1], kinds[:, ::-1]), walk, bed]), self._height

    def _mixer(self) -> tuple[Mesh, float]:
        half, width = 0.5 * self._length, 0.5 * self._width
        turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
        faces = np.where(
            np.abs(np.sin(turn + np.pi / 16)) > 0.9,
            ViewSide.TOP,
            np.where(np.cos(turn + np.pi / 16) > 0, ViewSide.RIGHT, ViewSide.LEFT),
        )
        rise = 0.5 * (self._height - self._floor) - 0.05
        stations = [
            (-half + 0.2, 0.45, 0.35),
            (-half + 0.5, 0.5, 0.3),
            (-0.1 * half, 1.0, 0.05),
            (0.4 * half, 1.0, -0.02),
            (half - 0.1, 0.55, -0.2),
            (half - 0.1, 0.0, -0.2),
        ]
        rings = np.stack(
            [
                np.stack(
                    [
                        np.full(16, x),
                        -r * width * np.cos(turn),
                        self._floor + 0.1 + rise * (1 + 0.9 * lift + r * np.sin(turn) * 0.95),
                    ],
                    -1,
                )
                for x, r, lift in stations
            ]
        )
        kinds = np.tile(faces, (len(stations) - 1, 1))
        kinds[-1] = ViewSide.FRONT
        bed = box((0, 0, self._floor), (self._length - 0.2, 0.9 * self._width, 0.2), ViewSide.UNDER)
        chute = frustum(
            (-half, -half + 0.5, -0.3, 0.3),
            (-half + 0.3, -half + 0.6, -0.5, 0.5),
            (self._floor, 0.9 * self._height),
            [ViewSide.UNDER] * 6,
        )
        return Mesh.joined([loft(rings[:, ::-1], kinds[:, ::-1]), bed, chute]), self._height

    def _pictures(self, top_m: float) -> list[np.ndarray]:
        draw, colour = self._draw, self._colour
        side = Canvas(self._length, self._height, colour, 320)
        self._flank(side, top_m)
        left = side.mirrored()
        ink: Colour = (
            draw.any_of(((28, 30, 40), (24, 60, 140), (180, 30, 34), (20, 104, 60)))
            if sum(colour) > 350
            else (236, 236, 232)
        )
        if draw.chance(0.65) and top_m - self._floor > 0.8:
            word, small = lettering(draw.rng, 4, 8), lettering(draw.rng, 8, 15)
            high = min(
                float(draw.rng.uniform(0.3, 0.8)),
                0.35 * (top_m - self._floor),
                1.2 * self._length / len(word),
            )
            x, z = (
                -0.44 * self._length,
                self._floor + float(draw.rng.uniform(0.35, 0.6)) * (top_m - self._floor),
            )
            for canvas in (side, left):
                canvas.word(word, (x, z), high, ink)
                canvas.word(small, (x, z - 0.7 * high), 0.4 * high, ink)
        dirt = float(draw.rng.beta(1.6, 4))
        back, front = (Canvas(self._width, self._height, colour, 128) for _ in range(2))
        self._rear(back, top_m)
        top = Canvas(self._length, self._width, shaded(colour, 0.95), 64)
        if self._cargo in ("tipper", "flatbed"):
            top = Canvas(self._length, self._width, draw.near((120, 100, 78), 15), 64)
        images = [canvas.worn(draw.rng, dirt) for canvas in (side, left, front, back, top)]
        return [*images, np.full((8, 8, 3), 24, dtype=np.uint8)]

    def _flank(self, canvas: Canvas, top_m: float) -> None:
        """Folds, ribs, stripes and edges."""
        draw, colour, half, floor = self._draw, self._colour, 0.5 * self._length, self._floor
        canvas.fade(
            [(-half, floor), (half, floor), (half, top_m), (-half, top_m)],
            shaded(colour, 0.82),
            shaded(colour, 1.04),
        )
        if draw.chance(0.35):
            low = floor + float(draw.rng.uniform(0.05, 0.5)) * (top_m - floor)
            canvas.rectangle(
                (-half, low),
                (half, low + float(draw.rng.uniform(0.15, 0.6))),
                draw.near(draw.any_of(_COLOURS), 8),
            )
        step = {"curtain": 0.55, "container": 0.26, "ribbed": 0.16, "tipper": 0.8, "refuse": 0.5}.get(
            self._cargo
        )
        if step is not None:
            for x in np.arange(-half + 0.2, half - 0.1, step):
                canvas.line([(x, floor + 0.05), (x, top_m - 0.05)], shaded(colour, 0.75), 0.04)
                canvas.line([(x + 0.05, floor + 0.05), (x + 0.05, top_m - 0.05)], shaded(colour, 1.12), 0.03)
        frame = draw.any_of(((196, 198, 200), shaded(colour, 0.7), (60, 62, 66)))
        for z in (floor + 0.05, top_m - 0.05):
            canvas.rectangle((-half, z - 0.05), (half, z + 0.05), frame)
        for x in (-half + 0.04, half - 0.04):
            canvas.rectangle((x - 0.05, floor), (x + 0.05, top_m), frame)
        for x in np.linspace(-half + 0.3, half - 0.3, max(3, round(self._length / 1.4))):
            canvas.rectangle((x - 0.05, floor + 0.02), (x + 0.05, floor + 0.08), (228, 120, 30))

    def _rear(self, canvas: Canvas, top_m: float) -> None:
        """Doors with their bars and hinges, or a shutter."""
        draw, colour, half, floor = self._draw, self._colour, 0.5 * self._width, self._floor
        canvas.fade(
            [(-half, floor), (half, floor), (half, top_m), (-half, top_m)], shaded(colour, 0.8), colour
        )
        dark = shaded(colour, 0.5)
        if self._cargo == "refuse":
            canvas.rectangle((-0.8 * half, floor), (0.8 * half, 0.6 * top_m), _BLACK)
        elif draw.chance(0.3):
            for z in np.arange(floor + 0.15, top_m - 0.1, 0.18):
                canvas.line([(-0.92 * half, z), (0.92 * half, z)], dark, 0.02)
        else:
            canvas.line([(0, floor), (0, top_m)], dark, 0.03)
            for y in (-0.7, -0.2, 0.2, 0.7):
                canvas.line([(y * half, floor + 0.05), (y * half, top_m - 0.05)], (170, 172, 176), 0.03)
        frame = shaded(colour, 0.65)
        canvas.line(
            [
                (-half + 0.04, floor),
                (-half + 0.04, top_m - 0.04),
                (half - 0.04, top_m - 0.04),
                (half - 0.04, floor),
            ],
            frame,
            0.07,
        )
        for y in (-0.85 * half, 0.85 * half):
            canvas.rectangle((y - 0.06, top_m - 0.1), (y + 0.06, top_m - 0.05), (190, 26, 28))
        if draw.chance(0.3) and top_m - floor > 1.0:
            canvas.word(
                lettering(draw.rng),
                (-0.7 * half, floor + 0.6 * (top_m - floor)),
                0.28,
                _BLACK if sum(colour) > 350 else (236, 236, 232),
            )

    def _bar(self, materials: Materials) -> Mesh:
        """The bar at the back with lamps, plate and warning stripes."""
        draw, half = self._draw, 0.5 * self._width
        canvas = Canvas(self._width, 0.34, (46, 47, 50), 128)
        lit = draw.chance(0.3)
        red: Colour = (255, 56, 42) if lit else (158, 18, 22)
        for side in (-1.0, 1.0):
            canvas.rectangle((side * 0.62 * half, 0.1), (side * 0.96 * half, 0.26), red)
            canvas.rectangle((side * 0.62 * half, 0.1), (side * 0.7 * half, 0.26), (224, 136, 32))
        canvas.rectangle((-0.26, 0.11), (0.26, 0.23), (232, 232, 228))
        canvas.word(
            "".join(draw.rng.choice(list("ABCDEFHKLMNPRS0123456789"), 7)), (-0.2, 0.14), 0.07, (24, 24, 34)
        )
        if draw.chance(0.4):
            for y in np.arange(-0.58 * half, 0.58 * half, 0.16):
                canvas.polygon(
                    [(y, 0.02), (y + 0.08, 0.02), (y + 0.12, 0.09), (y + 0.04, 0.09)], (226, 60, 40)
                )
        picture = materials.add(canvas.worn(draw.rng, 0.1), Semantic.TRUCK)
        dark = materials.add(np.full((8, 8, 3), 30, dtype=np.uint8), Semantic.TRUCK)
        z = self._floor - 0.28
        return box(
            (self._back + 0.06, 0, z), (0.1, self._width, 0.34), (dark, dark, picture, dark, dark, dark)
        )
