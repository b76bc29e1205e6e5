"""Fronts and backs of vehicles."""

from streetworld.edition2.layouts.variants import Colour, Draw
from streetworld.edition2.vehicles.parts.canvas import Canvas, Place
from streetworld.edition2.vehicles.parts.trim import Trim, shaded
from streetworld.edition2.vehicles.shape import BodyShape

HEADS, TAILS, GRILLES = 6, 7, 6
"""How many designs there are; the last fifth of each is held back for looks that are kept out."""

_BLACK: Colour = (17, 17, 19)
_CLEAR: Colour = (206, 210, 214)
_AMBER: Colour = (222, 132, 28)
_INK: Colour = (24, 24, 34)
_PLATE = list("ABCDEFHKLMNPRSTUVXYZ0123456789")


def paint_front(canvas: Canvas, draw: Draw, shape: BodyShape, trim: Trim) -> None:
    """Windscreen, headlamps, grille, bumper and plate."""
    half, nose = 0.5 * shape.width, shape.nose_z
    foot = 1.6 * shape.clearance
    canvas.fade([(-half, 0), (half, 0), (half, nose), (-half, nose)], shaded(trim.colour, 0.7), trim.colour)
    _windscreen(canvas, draw, shape, trim)
    if trim.bumper is not None:
        canvas.rectangle((-half, 0), (half, 0.55 * nose), trim.bumper)
    canvas.rectangle((-half, 0), (half, foot), trim.low)
    canvas.line([(-half, 0.56 * nose), (half, 0.56 * nose)], shaded(trim.colour, 0.55), 0.014)
    intake = 0.72 * half
    canvas.polygon(
        [
            (-intake, foot - 0.02),
            (intake, foot - 0.02),
            (0.86 * intake, 0.47 * nose),
            (-0.86 * intake, 0.47 * nose),
        ],
        _BLACK,
    )
    _grille(canvas, shape, trim)
    for side in (-1.0, 1.0):
        _headlamp(canvas, shape, trim, side)
        canvas.ellipse((side * 0.83 * half, 0.4 * nose), (0.07, 0.05), (150, 152, 156))
    if trim.plates[0] is not None:
        _plate(canvas, draw, (0.0, 0.47 * nose), trim.plates[0])


def _windscreen(canvas: Canvas, draw: Draw, shape: BodyShape, trim: Trim) -> None:
    low, high = shape.foot_half(), shape.roof_half()
    z0, z1 = shape.cowl_z, shape.rail_at(shape.screen) + 0.02
    canvas.polygon([(-low, z0), (low, z0), (high, z1), (-high, z1)], trim.colour)
    inset, rise = 0.9, z1 - z0
    glass = [
        (-inset * low, z0),
        (inset * low, z0),
        (inset * high, z1 - 0.06 * rise),
        (-inset * high, z1 - 0.06 * rise),
    ]
    canvas.polygon(glass, _BLACK)
    inner = [(0.96 * y, z0 + 0.02 + 0.94 * (z - z0)) for y, z in glass]
    canvas.fade(inner, shaded(trim.tint, 0.75), shaded(trim.tint, 1.5))
    if draw.chance(trim.see_through):
        mid = 0.5 * (low + high)
        canvas.fade(
            [
                (-0.66 * mid, z0 + 0.3 * rise),
                (0.66 * mid, z0 + 0.3 * rise),
                (0.6 * mid, z0 + 0.8 * rise),
                (-0.6 * mid, z0 + 0.8 * rise),
            ],
            shaded(trim.tint, 1.6),
            shaded(trim.tint, 2.4),
        )
    for y in (-0.42 * low, 0.42 * low):
        canvas.ellipse((y, z0 + 0.42 * rise), (0.12, 0.16), shaded(trim.tint, 0.55))
        canvas.rectangle((y - 0.24, z0), (y + 0.24, z0 + 0.3 * rise), shaded(trim.tint, 0.6))
    if draw.chance(0.6):
        driver = draw.any_of((-1, 1)) * 0.42 * low
        skin = draw.any_of(((92, 70, 58), (58, 44, 36), (74, 66, 62)))
        canvas.ellipse((driver, z0 + 0.46 * rise), (0.08, 0.11), skin)
        canvas.ellipse((driver, z0 + 0.14 * rise), (0.2, min(0.17 * rise, 0.25)), shaded(draw.muted(), 0.4))
    canvas.line([(-0.75 * low, z0 + 0.03), (0.1 * low, z0 + 0.09)], _BLACK, 0.02)
    canvas.line([(0.0, z0 + 0.03), (0.8 * low, z0 + 0.08)], _BLACK, 0.02)
    if trim.sign is not None:
        canvas.rectangle((-0.7 * high, z1 - 0.2 * rise), (0.7 * high, z1 - 0.05 * rise), _BLACK)
        canvas.word(trim.sign, (-0.6 * high, z1 - 0.17 * rise), 0.09 * rise, (255, 176, 40))


def _grille(canvas: Canvas, shape: BodyShape, trim: Trim) -> None:
    half, (low, high) = 0.5 * shape.width, trim.head_z
    if trim.grille == 0:
        canvas.rectangle((-0.55 * half, low + 0.02), (0.55 * half, high - 0.03), _BLACK)
        canvas.line(
            [(-0.55 * half, 0.5 * (low + high)), (0.55 * half, 0.5 * (low + high))], (150, 152, 156), 0.016
        )
    elif trim.grille == 1:
        down = 0.45 * low
        canvas.polygon(
            [(-0.5 * half, high), (0.5 * half, high), (0.36 * half, down), (-0.36 * half, down)],
            (120, 122, 126),
        )
        canvas.polygon(
            [
                (-0.47 * half, high - 0.02),
                (0.47 * half, high - 0.02),
                (0.33 * half, down + 0.02),
                (-0.33 * half, down + 0.02),
            ],
            _BLACK,
        )
    elif trim.grille == 2:
        for side in (-1.0, 1.0):
            canvas.polygon(
                [
                    (side * 0.03, low),
                    (side * 0.03, high),
                    (side * 0.34 * half, high),
                    (side * 0.28 * half, low),
                ],
                _BLACK,
            )
    elif trim.grille == 3:
        canvas.rectangle((-0.56 * half, low), (0.56 * half, high), (64, 66, 70))
        for share in (0.15, 0.4, 0.65, 0.9):
            z = low + share * (high - low)
            canvas.line([(-0.54 * half, z), (0.54 * half, z)], _CLEAR, 0.02)
    elif trim.grille == 4:
        canvas.line([(-0.5 * half, high - 0.02), (0.5 * half, high - 0.02)], shaded(trim.colour, 0.5), 0.015)
    else:
        canvas.rectangle((-0.5 * half, 0.6 * low), (0.5 * half, high), (34, 35, 38))
        for share in (-0.4, -0.2, 0.0, 0.2, 0.4):
            canvas.line([(share * half, 0.6 * low), (share * half, high)], (150, 152, 156), 0.025)
    canvas.ellipse((0.0, 0.5 * (low + high) + 0.01), (0.045, 0.04), (176, 178, 182))


def _headlamp(canvas: Canvas, shape: BodyShape, trim: Trim, side: float) -> None:
    half, (low, high) = 0.5 * shape.width, trim.head_z
    middle, tall = 0.5 * (low + high), high - low
    core: Colour = (255, 253, 240) if trim.head_lit else (246, 247, 248)

    def outline(*points: Place) -> list[Place]:
        return [(side * share * half, low + up * tall) for share, up in points]

    if trim.head == 0:  # slim, drawn outwards and up
        canvas.polygon(outline((0.52, 0.25), (0.55, 0.8), (1.0, 1.1), (1.0, 0.45)), (58, 60, 64))
        canvas.polygon(outline((0.6, 0.42), (0.62, 0.74), (0.96, 0.95), (0.96, 0.55)), _CLEAR)
        canvas.line(outline((0.56, 0.36), (1.0, 0.52)), core, 0.02)
    elif trim.head == 1:  # a rectangle
        canvas.polygon(outline((0.58, 0.0), (0.58, 1.0), (0.98, 1.0), (0.98, 0.0)), _CLEAR)
        canvas.polygon(outline((0.88, 0.0), (0.88, 1.0), (0.98, 1.0), (0.98, 0.0)), _AMBER)
    elif trim.head == 2:  # round
        canvas.ellipse((side * 0.78 * half, middle), (0.62 * tall, 0.62 * tall), (120, 122, 126))
        canvas.ellipse((side * 0.78 * half, middle), (0.52 * tall, 0.52 * tall), _CLEAR)
    elif trim.head == 3:  # large and pointed
        canvas.polygon(outline((0.5, 0.1), (0.62, 0.9), (0.98, 1.35), (1.0, 0.6), (0.85, -0.1)), _CLEAR)
    elif trim.head == 4:  # a rhomb
        canvas.polygon(outline((0.56, 0.2), (0.6, 1.0), (1.0, 1.0), (0.97, -0.2)), (70, 72, 76))
        canvas.polygon(outline((0.62, 0.3), (0.64, 0.9), (0.8, 0.9), (0.8, 0.1)), _CLEAR)
        canvas.polygon(outline((0.84, 0.1), (0.84, 0.9), (0.97, 0.9), (0.95, 0.0)), _CLEAR)
    else:  # a strip above, the lamp below
        canvas.polygon(outline((0.5, 0.85), (0.5, 1.0), (1.0, 1.05), (1.0, 0.85)), core)
        canvas.polygon(outline((0.68, -0.5), (0.68, 0.1), (0.96, 0.1), (0.96, -0.5)), (52, 54, 58))
        canvas.ellipse((side * 0.82 * half, low - 0.2 * tall), (0.2 * tall, 0.2 * tall), _CLEAR)
    radius = 0.26 * tall if not trim.head_lit else 0.42 * tall
    canvas.ellipse((side * 0.78 * half, middle), (1.1 * radius, radius), core)


def tail_outline(trim: Trim, shape: BodyShape) -> list[tuple[float, float, float, float, Colour]]:
    """Rectangles of the left tail lamp: from and to in y and z, and their colours."""
    half, top = 0.5 * shape.width, shape.edge_at(-0.5 * shape.length)
    red: Colour = (255, 54, 40) if trim.lit else (150, 16, 20)
    dark = shaded(red, 0.62)
    white: Colour = (220, 220, 222)
    pane = shape.rail_at(shape.roof)
    if trim.tail == 0:  # lying, round the corner
        return [
            (0.56 * half, half, 0.72 * top, 0.92 * top, red),
            (0.56 * half, 0.68 * half, 0.76 * top, 0.84 * top, white),
        ]
    if trim.tail == 1:  # standing below the window
        return [
            (0.78 * half, half, 0.58 * top, 0.97 * top, red),
            (0.78 * half, half, 0.66 * top, 0.72 * top, _AMBER),
        ]
    if trim.tail == 2:  # standing beside the window
        return [
            (0.84 * half, half, 0.74 * top, 0.55 * top + 0.45 * pane, red),
            (0.84 * half, half, 0.8 * top, 0.87 * top, _AMBER),
            (0.84 * half, half, 0.74 * top, 0.8 * top, white),
        ]
    if trim.tail == 3:  # two each
        return [
            (0.5 * half, 0.66 * half, 0.74 * top, 0.9 * top, dark),
            (0.72 * half, half, 0.74 * top, 0.9 * top, red),
        ]
    if trim.tail == 4:  # a band across
        return [(0.0, half, 0.82 * top, 0.88 * top, red), (0.66 * half, half, 0.76 * top, 0.93 * top, red)]
    if trim.tail == 5:  # a block low down
        return [
            (0.82 * half, 0.98 * half, 0.5 * top, 0.72 * top, red),
            (0.82 * half, 0.98 * half, 0.5 * top, 0.55 * top, white),
        ]
    return [(0.6 * half, half, 0.86 * top, 0.94 * top, red), (0.88 * half, half, 0.6 * top, 0.94 * top, red)]


def paint_back(canvas: Canvas, draw: Draw, shape: BodyShape, trim: Trim) -> None:
    """Rear window, tail lamps, plate and bumper."""
    half, top = 0.5 * shape.width, shape.edge_at(-0.5 * shape.length)
    foot = 1.8 * shape.clearance
    canvas.fade([(-half, 0), (half, 0), (half, top), (-half, top)], shaded(trim.colour, 0.68), trim.colour)
    dark = shaded(trim.colour, 0.45)
    _rear_window(canvas, draw, shape, trim)
    bumper = 0.5 * top
    if trim.bumper is not None:
        canvas.rectangle((-half, 0), (half, bumper), trim.bumper)
    canvas.rectangle((-half, 0), (half, foot), trim.low)
    canvas.line([(-half, bumper), (half, bumper)], dark, 0.016)
    for side in (-1.0, 1.0):
        canvas.line([(side * 0.72 * half, bumper), (side * 0.76 * half, top)], dark, 0.012)
        canvas.rectangle((side * 0.9 * half, 0.36 * top), (side * 0.72 * half, 0.4 * top), (126, 18, 20))
        for y0, y1, z0, z1, ink in tail_outline(trim, shape):
            canvas.rectangle((side * y0, z0), (side * y1, z1), shaded(ink, 0.45))
            canvas.rectangle((side * (y0 + 0.012), z0 + 0.012), (side * (y1 - 0.012), z1 - 0.012), ink)
    if trim.split_doors:
        canvas.line([(0.0, foot), (0.0, shape.height)], dark, 0.025)
        canvas.rectangle((0.03, 0.8 * top), (0.12, 0.84 * top), _BLACK)
    at = (0.0, 0.66 * top) if draw.chance(0.65) else (0.0, 0.38 * top)
    canvas.rectangle((at[0] - 0.34, at[1] - 0.1), (at[0] + 0.34, at[1] + 0.1), shaded(trim.colour, 0.7))
    _plate(canvas, draw, at, trim.plates[1])
    canvas.ellipse((0.0, 0.88 * top), (0.04, 0.036), (170, 172, 176))
    canvas.ellipse((-0.55 * half, foot - 0.02), (0.05, 0.035), (90, 90, 92))


def _rear_window(canvas: Canvas, draw: Draw, shape: BodyShape, trim: Trim) -> None:
    low, high = shape.foot_half(), shape.roof_half()
    z0, z1 = shape.deck_z + 0.02, shape.rail_at(shape.roof) + 0.02
    rise = z1 - z0
    canvas.polygon([(-low, z0), (low, z0), (high, z1), (-high, z1)], trim.colour)
    if not trim.rear_window:
        return
    inset = 0.82
    pane = [(-inset * low, z0 + 0.06 * rise), (inset * low, z0 + 0.06 * rise)]
    pane += [(inset * high, z1 - 0.1 * rise), (-inset * high, z1 - 0.1 * rise)]
    canvas.polygon(pane, _BLACK)
    tint = shaded(trim.tint, 0.5 + 0.5 * trim.privacy)
    canvas.fade(
        [(0.95 * y, z0 + 0.03 + 0.94 * (z - z0)) for y, z in pane], shaded(tint, 0.8), shaded(tint, 1.4)
    )
    if draw.chance(trim.see_through):
        wide = 0.55 * high
        canvas.fade(
            [
                (-wide, z0 + 0.4 * rise),
                (wide, z0 + 0.4 * rise),
                (wide, z0 + 0.8 * rise),
                (-wide, z0 + 0.8 * rise),
            ],
            shaded(tint, 2.0),
            shaded(tint, 2.6),
        )
    for y in (-0.48 * low, 0.0, 0.48 * low):
        canvas.ellipse((y, z0 + 0.28 * rise), (0.1, 0.1), shaded(tint, 0.55))
    canvas.rectangle(
        (-0.12, z1 - 0.09 * rise), (0.12, z1 - 0.05 * rise), (236, 40, 34) if trim.lit else (110, 16, 18)
    )


def _plate(canvas: Canvas, draw: Draw, at: Place, colour: Colour) -> None:
    y, z = at
    canvas.rectangle((y - 0.27, z - 0.065), (y + 0.27, z + 0.065), _BLACK)
    canvas.rectangle((y - 0.26, z - 0.055), (y + 0.26, z + 0.055), colour)
    canvas.rectangle((y - 0.26, z - 0.055), (y - 0.215, z + 0.055), (30, 60, 150))
    canvas.word("".join(draw.rng.choice(_PLATE, 7)), (y - 0.19, z - 0.035), 0.07, _INK)
