"""Lamps, signs, masts, traffic lights, bins and cones of many sorts."""

import cv2
import numpy as np

from dreamdrive.scene.street.layout import Prop
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.roadside.paints import Paints
from streetworld.edition2.roadside.plants import bars
from streetworld.engine import paint
from streetworld.engine.mesh import Mesh, ball, box, cylinder, frustum

_STEEL = [
    (98, 104, 106),
    (150, 152, 152),
    (52, 54, 56),
    (40, 62, 50),
    (120, 116, 108),
    (92, 74, 58),
    (196, 194, 188),
]


def _steel(rng: np.random.Generator, paints: Paints) -> int:
    return paints.plain(("steel",), Semantic.POLE, _STEEL[int(rng.integers(len(_STEEL)))], 0.03)


def _light(
    paints: Paints, kind: Semantic, colour: tuple[float, float, float], day: float, night: float = 1.0
) -> int:
    """A surface that shines at night; shares of its colour by day and by night."""
    image = np.full((8, 8, 3), colour, np.float32)
    return paints.get(
        ("light", colour, night),
        kind,
        lambda: paint.finished(day * image),
        glow=lambda: paint.finished(night * image),
    )


def lamp_head(prop: Prop) -> np.ndarray:
    """Where the light of a lamp is, in its own frame."""
    rng = np.random.default_rng([prop.look, 82])
    sort, arm = int(rng.integers(4)), float(rng.uniform(0.8, 3.0))
    out = (arm, 0.0, 0.4 * arm, arm)[sort]
    return np.array([out, 0.0, prop.height_m + (0.12 if sort != 1 else 0.2)])


def lamp(prop: Prop, paints: Paints) -> Mesh:
    """A street lamp: an arm, a lantern on top, two arms, or a bent tube."""
    rng = np.random.default_rng([prop.look, 82])
    sort, arm = int(rng.integers(4)), float(rng.uniform(0.8, 3.0))
    steel, top = _steel(rng, paints), prop.height_m
    glow = _light(paints, Semantic.POLE, (255.0, 235.0, 195.0), 0.8)
    post = cylinder((0, 0, 0), (0, 0, top), (rng.uniform(0.07, 0.14), 0.05), steel, None, 8)
    if sort == 1:
        lantern = frustum(
            (-0.12, 0.12, -0.12, 0.12),
            (-0.22, 0.22, -0.22, 0.22),
            (top, top + 0.45),
            [glow] * 4 + [steel] * 2,
        )
        return Mesh.joined([post, lantern, ball((0, 0, top + 0.5), (0.2, 0.2, 0.12), steel, 4)])
    ends = (arm, -arm) if sort == 2 else (arm,)
    parts = [post]
    for end in ends:
        out = 0.4 * end if sort == 2 else end
        rise = rng.uniform(0, 0.5)
        parts.append(cylinder((0, 0, top - rise), (out, 0, top + 0.12), (0.05, 0.035), steel, None, 6))
        faces = [steel, steel, steel, steel, steel, glow]
        parts.append(box((out, 0, top + 0.12), (0.6, 0.24, 0.12), faces))
    return Mesh.joined(parts)


def mast(prop: Prop, paints: Paints) -> Mesh:
    """A mast of wood, steel or concrete with cross arms and, from it, wires to both sides."""
    rng = np.random.default_rng([prop.look, 83])
    colour = [(104, 84, 66), (132, 120, 104), (150, 150, 146), (84, 78, 72)][int(rng.integers(4))]
    wood, wire = (
        paints.plain(("mast",), Semantic.POLE, colour),
        paints.plain(("wire",), Semantic.POLE, (36, 36, 38)),
    )
    top = prop.height_m
    parts = [cylinder((0, 0, 0), (0, 0, top), (0.16, 0.1), wood, None, 7)]
    arms = int(rng.integers(1, 4))
    for k in range(arms):
        z, half = top - 0.3 - 0.8 * k, rng.uniform(0.5, 1.1)
        parts.append(box((0, 0, z), (2 * half, 0.1, 0.12), wood))
        for out in (-half, half):
            sag = rng.uniform(0.5, 1.2)
            for side in (-1, 1):  # wires run along the road, across the direction the mast looks
                way = np.linspace(0, 1, 6)
                low = z + 0.1 - 2 * sag * way * (1 - 0.5 * way)
                line = np.stack([np.full(6, out), side * 32 * way, low], -1)
                parts.append(bars(line[:-1], line[1:], np.full((5, 2), 0.014), wire))
    if rng.random() < 0.25:
        parts.append(cylinder((0.3, 0, top - 2.4), (0.3, 0, top - 1.5), (0.22, 0.22), wire, wire, 8))
    return Mesh.joined(parts)


def traffic_light(prop: Prop, paints: Paints) -> Mesh:
    """A signal on a post, or over the road on an arm; it looks along x."""
    rng = np.random.default_rng([prop.look, 84])
    steel = _steel(rng, paints)
    shell = paints.plain(
        ("shell",), Semantic.SIGN, [(24, 26, 26), (40, 44, 40), (196, 160, 40)][int(rng.integers(3))]
    )
    on = int(rng.integers(3))
    lamps = [(255.0, 40.0, 30.0), (255.0, 180.0, 40.0), (40.0, 240.0, 150.0)]
    discs = [_light(paints, Semantic.SIGN, lamps[k], *((1, 1) if k == on else (0.18, 0))) for k in range(3)]
    top = prop.height_m
    parts = [cylinder((0, 0, 0), (0, 0, top), (0.07, 0.06), steel, None, 8)]
    places = [(0.0, 0.0, min(top, 3.2) - 0.5)]
    if top > 4.2:
        reach = rng.uniform(2.5, 6.5)
        parts.append(cylinder((0, 0, top - 0.1), (0, reach, top), (0.06, 0.04), steel, None, 6))
        places += [(0.0, reach * s, top - 0.45) for s in (0.6, 0.95)]
    if rng.random() < 0.5:
        places[0] = (0.0, 0.25, places[0][2])
    for x, y, z in places:
        parts.append(box((x + 0.12, y, z), (0.2, 0.34, 1.0), shell))
        parts.append(
            box((x + 0.02, y, z), (0.02, 0.6, 1.25), shell) if rng.random() < 0.4 else Mesh.joined([])
        )
        for k, disc in enumerate(discs):
            middle = z + 0.31 * (1 - k)
            parts.append(cylinder((x + 0.2, y, middle), (x + 0.24, y, middle), (0.11, 0.11), shell, disc, 10))
    return Mesh.joined(parts)


def bin_(prop: Prop, paints: Paints) -> Mesh:
    """A bin, a cabinet, a hydrant, a bollard or a box for letters."""
    rng = np.random.default_rng([prop.look, 85])
    colour = [
        (40, 60, 46),
        (60, 62, 66),
        (34, 66, 120),
        (150, 36, 30),
        (190, 160, 40),
        (128, 126, 120),
        (24, 26, 28),
    ]
    paint_ = paints.plain(("bin",), Semantic.WALL, colour[int(rng.integers(len(colour)))])
    high, sort = prop.height_m, int(rng.integers(3))
    if sort == 0:
        return cylinder((0, 0, 0), (0, 0, high), (0.22 * high, 0.26 * high), paint_, paint_, 10)
    if sort == 1:
        wide = rng.uniform(0.5, 1.1) * high
        lid = box((0, 0, high + 0.03), (1.05 * wide, 0.9 * wide, 0.08), paint_)
        return Mesh.joined(
            [
                frustum(
                    (-0.45 * wide, 0.45 * wide, -0.38 * wide, 0.38 * wide),
                    (-0.5 * wide, 0.5 * wide, -0.42 * wide, 0.42 * wide),
                    (0, high),
                    [paint_] * 6,
                ),
                lid,
            ]
        )
    return Mesh.joined(
        [
            cylinder((0, 0, 0), (0, 0, high), (0.07, 0.07), paint_, paint_, 8),
            ball((0, 0, high), (0.1, 0.1, 0.1), paint_, 5),
        ]
    )


def cone(prop: Prop, paints: Paints) -> Mesh:
    """A traffic cone or a striped post."""
    rng, high = np.random.default_rng([prop.look, 86]), prop.height_m
    orange = [(226, 84, 28), (214, 60, 40), (236, 130, 40)][int(rng.integers(3))]

    def make() -> paint.Image:
        image = np.full((32, 8, 3), orange, np.float32)
        image[6:13] = image[18:24] = 235
        return paint.finished(image)

    striped = paints.get(("cone", orange), Semantic.WALL, make)
    dark = paints.plain(("base",), Semantic.WALL, orange if rng.random() < 0.5 else (30, 30, 32))
    radii = (0.22 * high, 0.04 * high) if rng.random() < 0.7 else (0.06, 0.06)
    return Mesh.joined(
        [
            cylinder((0, 0, 0.03), (0, 0, high), radii, striped, None, 10),
            box((0, 0, 0.02), (0.55 * high, 0.55 * high, 0.04), dark),
        ]
    )


def sign(prop: Prop, paints: Paints) -> Mesh:
    """A sign on its post, its face along x: round, triangular, square, long, or a board over the road."""
    rng = np.random.default_rng([prop.look, 87])
    steel, top = _steel(rng, paints), prop.height_m
    back = paints.plain(("back",), Semantic.SIGN, (128, 130, 130))
    shape = str(
        rng.choice(
            ["round", "triangle", "square", "octagon", "long", "board"], p=[0.28, 0.2, 0.2, 0.06, 0.14, 0.12]
        )
    )
    face = paints.get(
        ("sign", prop.look), Semantic.SIGN, lambda: _face(np.random.default_rng([prop.look, 88]), shape)
    )
    if shape == "board" and top > 3.5:
        wide, high = rng.uniform(2.5, 5.5), rng.uniform(1.5, 3.0)
        posts = [
            cylinder((0, s * 0.4 * wide, 0), (0, s * 0.4 * wide, top), (0.09, 0.09), steel, None, 6)
            for s in (-1, 1)
        ]
        board = box((0.08, 0, top - 0.5 * high), (0.06, wide, high), [back, back, back, face, back, back])
        return Mesh.joined([*posts, board])
    size = rng.uniform(0.55, 1.0)
    post = cylinder((0, 0, 0), (0, 0, top), (0.035, 0.035), steel, None, 6)
    z = top - 0.5 * size - 0.05
    if shape in ("square", "long", "board"):
        wide, high = (
            (size, size)
            if shape == "square"
            else (size * rng.uniform(0.5, 2.2), size * rng.uniform(0.5, 1.2))
        )
        return Mesh.joined(
            [post, box((0.05, 0, z), (0.03, wide, high), [back, back, back, face, back, back])]
        )
    corners = {"round": 16, "triangle": 3, "octagon": 8}[shape]
    start = {"round": 0.0, "triangle": np.pi / 2 if rng.random() < 0.8 else -np.pi / 2, "octagon": np.pi / 8}[
        shape
    ]
    return Mesh.joined(
        [
            post,
            _plate(corners, start, 0.5 * size, (0.05, z), face),
            _plate(corners, start, 0.5 * size, (0.045, z), back),
        ]
    )


def _plate(corners: int, start: float, radius: float, at: tuple[float, float], material: int) -> Mesh:
    """An upright regular polygon that faces along x."""
    turn = start + 2 * np.pi * np.arange(corners + 1) / corners
    y, z = radius * np.cos(turn), radius * np.sin(turn)
    ring = np.stack([np.full(corners + 1, at[0]), y, at[1] + z], -1)
    uv = np.stack([0.5 + 0.48 * np.cos(turn), 0.5 - 0.48 * np.sin(turn)], -1)
    middle, centre = np.array([at[0], 0, at[1]]), np.array([0.5, 0.5])
    triangles = np.stack([np.repeat(middle[None], corners, 0), ring[:-1], ring[1:]], 1)
    places = np.stack([np.repeat(centre[None], corners, 0), uv[:-1], uv[1:]], 1)
    return Mesh(triangles, places, np.full(corners, material))


def _face(rng: np.random.Generator, shape: str) -> paint.Image:
    """What is on a sign: a rim and a field with a symbol, or lines of letters."""
    colours = {
        "red": (190, 30, 34),
        "blue": (24, 76, 160),
        "green": (10, 104, 66),
        "yellow": (240, 190, 30),
        "white": (238, 238, 232),
        "black": (24, 24, 26),
        "brown": (110, 66, 40),
    }
    ink = {k: np.array(v, np.float32) for k, v in colours.items()}
    size = 64
    if shape in ("long", "board"):
        return _board(rng, ink)
    rim, field = {
        "round": [("red", "white"), ("blue", "blue"), ("red", "blue"), ("red", "red"), ("red", "yellow")],
        "triangle": [("red", "white"), ("red", "yellow"), ("red", "white")],
        "square": [("black", "yellow"), ("white", "blue"), ("black", "white"), ("white", "green")],
        "octagon": [("white", "red")],
    }[shape][int(rng.integers({"round": 5, "triangle": 3, "square": 4, "octagon": 1}[shape]))]
    image = np.empty((size, size, 3), np.float32)
    image[:] = ink[rim]
    if shape == "triangle":
        inner = np.array([[32, 14], [50, 46], [14, 46]], np.int32)
        cv2.fillPoly(image, [inner], ink[field].tolist())
    else:
        cv2.circle(image, (32, 32), 22, ink[field].tolist(), -1) if shape == "round" else cv2.rectangle(
            image, (5, 5), (58, 58), ink[field].tolist(), -1
        )
    _symbol(rng, image, shape, dark=bool(ink[field].mean() < 130))
    return paint.finished(image * (1 - rng.uniform(0, 0.25)))


def _board(rng: np.random.Generator, ink: dict[str, np.ndarray]) -> paint.Image:
    """Lines of letters on a field of one of some colours."""
    size = 64
    width = 128
    field = ink[str(rng.choice(["blue", "green", "white", "yellow", "brown", "green"]))]
    image = np.empty((size, width, 3), np.float32)
    image[:] = field
    letter = 245.0 if field.mean() < 150 else 25.0
    cv2.rectangle(image, (2, 2), (width - 3, size - 3), (letter,) * 3, 1)
    for row in range(int(rng.integers(1, 4))):
        text = "".join(
            rng.choice(list("ABCDEFGHIJKLMNOPRSTUVabcdeghiklmnorstu 0123456789"), int(rng.integers(4, 10)))
        )
        paint.write(image, text, (8, 18 + 18 * row), 0.5, (letter,) * 3, 1)
    return paint.finished(image)


def _symbol(rng: np.random.Generator, image: np.ndarray, shape: str, *, dark: bool) -> None:
    """A number, an arrow, a bar or a figure in the middle of a sign, in place."""
    symbol = (245.0,) * 3 if dark else (20.0,) * 3
    kind = rng.integers(4)
    if kind == 0 or shape == "octagon":
        text = (
            str(rng.choice(["30", "50", "60", "80", "P", "STOP", "40", "100", "X"]))
            if shape != "octagon"
            else "STOP"
        )
        scale = 0.9 if len(text) < 3 else 0.55
        paint.write(image, text, (14 if len(text) < 3 else 11, 41), scale, symbol, 2)
    elif kind == 1:
        cv2.arrowedLine(
            image, (32, 46), (32 + int(rng.integers(-10, 11)), 18), symbol, 5, cv2.LINE_AA, 0, 0.5
        )
    elif kind == 2:
        cv2.rectangle(image, (18, 28), (46, 36), symbol, -1)
    else:
        cv2.circle(image, (32, 26), 4, symbol, -1)
        cv2.line(image, (32, 28), (32, 42), symbol, 5)
