"""Pictures thrown onto the sides of a vehicle: windows, doors, lamps, grilles, plates, dirt."""

from dataclasses import replace

import numpy as np

from streetworld.edition2.layouts.variants import Colour, Draw
from streetworld.edition2.vehicles.parts.canvas import Canvas, Place
from streetworld.edition2.vehicles.parts.fronts import paint_back, paint_front, tail_outline
from streetworld.edition2.vehicles.parts.trim import Trim, shaded
from streetworld.edition2.vehicles.shape import BodyShape
from streetworld.engine.paint import Image

_BLACK: Colour = (17, 17, 19)


def paint_skin(draw: Draw, shape: BodyShape, trim: Trim) -> list[Image]:
    """Pictures of a car, van, cab or bus in the order of ``Side``."""
    side = Canvas(shape.length, shape.height, trim.colour, 256 if shape.length < 7 else 400)
    _side(side, draw, shape, trim)
    mirrored = side.mirrored()
    gated = side if trim.gates_right else mirrored
    sign = 1 if trim.gates_right else -1
    paint_gates(gated, replace(trim, gates=tuple((sign * a, sign * b, c, d) for a, b, c, d in trim.gates)))
    if trim.letters is not None:
        for word, (x, z), high in trim.letters.words:
            side.word(word, (x, z), high, trim.letters.ink)
            mirrored.word(word, (-x - side.word_m(word, high), z), high, trim.letters.ink)
    front, back = (Canvas(shape.width, shape.height, trim.colour, 128) for _ in range(2))
    paint_front(front, draw, shape, trim)
    paint_back(back, draw, shape, trim)
    top = Canvas(shape.length, shape.width, trim.colour, 128)
    _top(top, draw, shape, trim)
    dirt = trim.dirt
    rng = draw.rng
    pictures = [
        side.worn(rng, dirt),
        mirrored.worn(rng, dirt),
        front.worn(rng, dirt),
        back.worn(rng, 1.2 * dirt),
    ]
    return [*pictures, top.worn(rng, 0.0), np.full((8, 8, 3), 13, dtype=np.uint8)]


def ruled(shape: BodyShape, share: float, up: float) -> Place:
    """Place on a side's band of windows: from its front to its back, from its lower to its upper edge."""
    corner = 0.5 ** (1 / shape.round_plan)
    ends = []
    for back, front in ((shape.deck, shape.cowl), (shape.roof, shape.screen)):
        middle, half = 0.5 * (back + front), 0.5 * (front - back)
        ends.append(middle + half * corner * (1 - 2 * share))
    x = ends[0] + up * (ends[1] - ends[0])
    low, high = shape.edge_at(ends[0]) + 0.02, shape.rail_at(ends[1])
    return x, low + up * (high - low)


def _side(canvas: Canvas, draw: Draw, shape: BodyShape, trim: Trim) -> None:
    half = 0.5 * shape.length
    colour = trim.colour
    xs = np.linspace(-half, half, 24)
    shoulder = shape.edge(xs)
    # Light from above: brighter towards the shoulder, darker towards the sill.
    body = [*zip(xs, shoulder, strict=True), (half, 0), (-half, 0)]
    canvas.fade(body, shaded(colour, 0.72), shaded(colour, 1.06))
    if trim.band is not None:
        low, high = trim.band_z
        canvas.rectangle((-half, low), (half, high), trim.band)
    crease = 0.62 + 0.12 * trim.crease
    for shift, light in ((0.0, 1.16), (-0.05, 0.8)):
        line = [(x, crease * z + shift) for x, z in zip(xs, shoulder, strict=True)]
        canvas.line(line[2:-2], shaded(colour, light), 0.02)
    _foot(canvas, shape, trim, xs)
    _windows(canvas, draw, shape, trim)
    _doors(canvas, shape, trim)
    for axle in shape.axles:
        canvas.ellipse((axle, shape.wheel), (1.17 * shape.wheel, 1.17 * shape.wheel), shaded(colour, 0.55))
        canvas.ellipse((axle, shape.wheel), (1.12 * shape.wheel, 1.12 * shape.wheel), _BLACK)
    low, high = trim.head_z
    lamp = [(half, low), (half, high), (half - trim.head_m, high), (half - 0.6 * trim.head_m, low)]
    canvas.polygon(lamp, (196, 200, 204))
    canvas.polygon([lamp[0], lamp[1], (half - 0.3 * trim.head_m, high)], (232, 234, 236))
    reach = min(0.28, 0.05 * shape.length)
    for _y0, y1, z0, z1, ink in tail_outline(trim, shape):
        if y1 > 0.44 * shape.width:
            canvas.rectangle((-half, z0), (-half + reach, z1), ink)
    canvas.rectangle((half - 0.5, 0.5 * low + 0.1), (half - 0.42, 0.5 * low + 0.14), (216, 130, 30))


def _foot(canvas: Canvas, shape: BodyShape, trim: Trim, xs: np.ndarray) -> None:
    """Sills and the ends' bumpers."""
    half = 0.5 * shape.length
    sill = shape.clearance + trim.sill_m
    canvas.rectangle((-half, 0), (half, sill), trim.low)
    if trim.clad:
        for axle in shape.axles:
            canvas.ellipse((axle, shape.wheel), (1.34 * shape.wheel, 1.34 * shape.wheel), trim.low)
    if trim.bumper is not None:
        for x in (-half, half):
            inside = x - np.sign(x) * 0.12 * shape.length
            canvas.rectangle((inside, 0), (x, 0.55 * float(shape.nose_z)), trim.bumper)
    if trim.rubbing:
        canvas.rectangle((-0.62 * half, 0.5), (0.62 * half, 0.56), trim.low)
    del xs


def _windows(canvas: Canvas, draw: Draw, shape: BodyShape, trim: Trim) -> None:
    rng = draw.rng
    for row in trim.rows:
        _row(canvas, draw, trim, row)
    if not trim.panes:
        return
    first, last = trim.panes[0][0], trim.panes[-1][1]
    frame = [(first - 0.008, 0.03), (first - 0.008, 0.99), (last + 0.008, 0.99), (last + 0.008, 0.03)]
    band = [ruled(shape, f, u) for f, u in frame]
    if trim.joined_panes:
        canvas.polygon(band, _BLACK)
    for i, (start, end) in enumerate(trim.panes):
        low, high = trim.pane_z
        outline = [ruled(shape, f, u) for f, u in ((start, low), (start, high), (end, high), (end, low))]
        tint = trim.tint if i == 0 else shaded(trim.tint, trim.privacy)
        canvas.fade(outline, shaded(tint, 0.8), shaded(tint, 1.25))
        if rng.random() < trim.see_through:
            # Through the windows of the other side there is light.
            near, far = start + 0.25 * (end - start), start + rng.uniform(0.7, 1.0) * (end - start)
            seen = [
                ruled(shape, f, u)
                for f, u in ((near, 0.3), (near, high - 0.12), (far, high - 0.12), (far, 0.35))
            ]
            light = rng.uniform(1.5, 3.2)
            canvas.fade(seen, shaded(tint, light), shaded(tint, 1.1 * light))
            head = ruled(shape, 0.5 * (start + end) + 0.06, 0.36)
            canvas.ellipse(head, (0.1, 0.13), shaded(tint, 0.6))
    if trim.chrome:
        canvas.line([band[0], band[3]], (208, 210, 212), 0.02)


def _row(canvas: Canvas, draw: Draw, trim: Trim, row: tuple[float, float, float, float, int]) -> None:
    """A row of like windows, with seats and people behind."""
    x0, x1, z0, z1, count = row
    if trim.joined_panes:
        canvas.rectangle((x0 - 0.04, z0 - 0.04), (x1 + 0.04, z1 + 0.04), _BLACK)
    step = (x1 - x0) / count
    for i in range(count):
        a, b = x0 + i * step + 0.03, x0 + (i + 1) * step - 0.03
        tint = shaded(trim.tint, float(draw.rng.uniform(0.8, 1.25)))
        canvas.fade([(a, z0), (b, z0), (b, z1), (a, z1)], shaded(tint, 0.8), shaded(tint, 1.4))
        if draw.chance(trim.see_through):
            light = float(draw.rng.uniform(1.4, 2.6))
            low, high = z0 + 0.3 * (z1 - z0), z1 - 0.15 * (z1 - z0)
            outline = [
                (a + 0.15 * step, low),
                (b - 0.1 * step, low),
                (b - 0.1 * step, high),
                (a + 0.15 * step, high),
            ]
            canvas.fade(outline, shaded(tint, light), shaded(tint, 1.2 * light))
        for seat in (0.3, 0.75):
            if draw.chance(0.7):
                canvas.ellipse((a + seat * step, z0 + 0.22), (0.16, 0.2), shaded(tint, 0.6))


def paint_gates(canvas: Canvas, trim: Trim) -> None:
    """The doors of a bus: glass in two wings."""
    for x0, x1, z0, z1 in trim.gates:
        canvas.rectangle((x0, z0), (x1, z1), _BLACK)
        middle = 0.5 * (x0 + x1)
        for a, b in ((x0 + 0.06, middle - 0.04), (middle + 0.04, x1 - 0.06)):
            outline = [(a, z0 + 0.12), (b, z0 + 0.12), (b, z1 - 0.08), (a, z1 - 0.08)]
            canvas.fade(outline, shaded(trim.tint, 1.1), shaded(trim.tint, 1.6))


def _doors(canvas: Canvas, shape: BodyShape, trim: Trim) -> None:
    dark = shaded(trim.colour, 0.42)
    sill = shape.clearance + trim.sill_m
    for start, end, sliding in trim.doors:
        x0, top = ruled(shape, start, 0.0)
        x1, _ = ruled(shape, end, 0.0)
        for x in (x0, x1):
            canvas.line([(x, top), (x, sill)], dark, 0.012)
        canvas.line([(x0, sill), (x1, sill)], dark, 0.012)
        handle = x1 + 0.16 if not sliding else x0 - 0.16
        z = 0.85 * top if trim.handle_z is None else trim.handle_z
        canvas.rectangle((handle - 0.09, z - 0.02), (handle + 0.09, z + 0.02), trim.handle)
        canvas.line([(handle - 0.09, z - 0.035), (handle + 0.09, z - 0.035)], dark, 0.01)
    x, z = -0.33 * shape.length, 0.8 * shape.edge_at(-0.33 * shape.length)
    canvas.line([(x, z), (x + 0.16, z), (x + 0.16, z - 0.16), (x, z - 0.16), (x, z)], dark, 0.01)


def _top(canvas: Canvas, draw: Draw, shape: BodyShape, trim: Trim) -> None:
    """Bonnet, roof and boot from above; seen upright, the car's left is above."""
    half, middle = 0.5 * shape.length, 0.5 * shape.width
    side = shape.roof_half() + 0.02
    canvas.rectangle((shape.deck, middle - side), (shape.cowl, middle + side), trim.roof)
    if trim.sunroof:
        end = 0.5 * (shape.roof + shape.screen) if draw.chance(0.6) else shape.roof + 0.3
        canvas.rectangle((end, middle - 0.7 * side), (shape.screen - 0.15, middle + 0.7 * side), (24, 26, 30))
    dark = shaded(trim.colour, 0.5)
    if half - shape.cowl > 0.4:
        for share in (-0.82, 0.82):
            y = middle + share * shape.foot_half()
            canvas.line([(shape.cowl, y), (half - 0.15, middle + 0.75 * (y - middle))], dark, 0.015)
        canvas.rectangle((shape.cowl - 0.02, middle - side), (shape.cowl + 0.1, middle + side), _BLACK)
    if shape.deck + half > 0.25:
        canvas.rectangle((shape.deck - 0.05, middle - side), (shape.deck, middle + side), _BLACK)
        if trim.bed is not None:
            inset = 0.09
            canvas.rectangle((-half + inset, inset), (shape.deck - 0.05, shape.width - inset), trim.bed)
