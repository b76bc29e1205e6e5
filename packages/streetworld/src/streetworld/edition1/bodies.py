"""Road users: meshes of rigid parts, and how the parts turn as the whole moves on.

The frame of a body: x ahead, y to the left, z up, the origin on the ground under the middle.
"""

from dataclasses import dataclass

import numpy as np

from dreamdrive.scene.level import pitched
from dreamdrive.scene.street.layout import BoxKind
from dreamdrive.scene.street.truth import Semantic
from streetworld.engine import paint
from streetworld.engine.bodies import Part, Size, Turn
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh, ball, cylinder, frustum

_CLASS = {
    "car": Semantic.CAR,
    "van": Semantic.VAN,
    "truck": Semantic.TRUCK,
    "bicycle": Semantic.BICYCLE,
    "pedestrian": Semantic.PEDESTRIAN,
}
_BRIGHT = [(172, 36, 38), (42, 84, 160), (206, 206, 208), (216, 172, 60), (44, 118, 90), (150, 156, 162)]
_DARK = [(26, 27, 30), (34, 36, 44), (40, 30, 30), (24, 34, 30)]
_SKIN = [(224, 180, 150), (170, 120, 90), (110, 76, 58)]
_GLOSS = 0.06


def body(kind: BoxKind, size_m: Size, look: int, materials: Materials) -> list[Part]:
    """Parts of a road user; equal looks give equal bodies."""
    rng = np.random.default_rng([look, list(_CLASS).index(kind)])
    build = {"car": _car, "van": _van, "truck": _truck, "bicycle": _bicycle, "pedestrian": _pedestrian}
    return build[kind](rng, size_m, materials)


def _paint(rng: np.random.Generator) -> tuple[paint.Colour, bool]:
    """Colour, and whether something is printed on it: a half are printed, a quarter plain and dark."""
    choice = rng.random()
    colours = _DARK if 0.5 <= choice < 0.75 else _BRIGHT
    return colours[int(rng.integers(len(colours)))], choice < 0.5


@dataclass(frozen=True)
class _Finish:
    """Materials of a vehicle."""

    side: int
    front: int
    back: int
    panel: int
    glass: int
    under: int
    tyre: int
    rim: int


def _finish(rng: np.random.Generator, size_m: Size, kind: Semantic, materials: Materials) -> _Finish:
    length, width, height = size_m
    colour, printed = _paint(rng)

    def add(image: paint.Image, gloss: float = 0.0) -> int:
        return materials.add(image, kind, gloss=gloss)

    return _Finish(
        side=add(paint.flank(rng, length, 0.5 * height, colour, printed), _GLOSS),
        front=add(paint.end(rng, width, 0.5 * height, colour, (250, 246, 226)), _GLOSS),
        back=add(paint.end(rng, width, 0.5 * height, colour, (176, 24, 24)), _GLOSS),
        panel=add(paint.panel(rng, colour), _GLOSS),
        glass=add(paint.glass(rng, 0.5 * length, 0.35 * height), 2 * _GLOSS),
        under=add(paint.panel(rng, (22, 22, 24))),
        tyre=add(paint.panel(rng, (28, 28, 30))),
        rim=add(paint.wheel(rng)),
    )


def _wheels(size_m: Size, radius_m: float, finish: _Finish) -> list[Part]:
    length, width, _ = size_m
    pair = Mesh.joined(
        [
            cylinder((0, y - 0.11, 0), (0, y + 0.11, 0), (radius_m, radius_m), finish.tyre, finish.rim, 12)
            for y in (0.5 * width - 0.12, 0.12 - 0.5 * width)
        ]
    )
    return [Part(pair, _rolling((x, 0.0, radius_m), radius_m)) for x in (0.3 * length, -0.3 * length)]


def _rolling(at_m: tuple[float, float, float], radius_m: float) -> Turn:
    return lambda way_m: pitched(at_m, way_m / radius_m)


def _car(rng: np.random.Generator, size_m: Size, materials: Materials) -> list[Part]:
    length, width, height = size_m
    f = _finish(rng, size_m, Semantic.CAR, materials)
    front, back, side = 0.5 * length, -0.5 * length, 0.5 * width
    belt = 0.58 * height
    bonnet, boot = front - rng.uniform(0.2, 0.27) * length, back + rng.uniform(0.03, 0.16) * length
    low = (back + 0.08, front - 0.08, -side + 0.04, side - 0.04)
    high = (back, front, -side, side)
    nose = (back + 0.05, front - 0.12, 0.06 - side, side - 0.06)
    roof = (boot + rng.uniform(0.2, 0.5), bonnet - rng.uniform(0.55, 0.8), 0.2 - side, side - 0.2)
    cabin = (boot, bonnet, 0.06 - side, side - 0.06)
    meshes = [
        frustum(low, high, (0.18, 0.3 * height), (f.under, f.under, f.under, f.under, None, f.under)),
        frustum(high, nose, (0.3 * height, belt), (f.side, f.side, f.back, f.front, f.panel, None)),
        frustum(cabin, roof, (belt, height), (f.glass, f.glass, f.glass, f.glass, f.panel, None)),
    ]
    return [Part(Mesh.joined(meshes)), *_wheels(size_m, 0.31, f)]


def _van(rng: np.random.Generator, size_m: Size, materials: Materials) -> list[Part]:
    length, width, height = size_m
    f = _finish(rng, size_m, Semantic.VAN, materials)
    front, back, side = 0.5 * length, -0.5 * length, 0.5 * width
    belt = 0.5 * height
    flanks = (back, front, -side, side)
    top = (back + 0.03, front - 0.32 * length, 0.08 - side, side - 0.08)
    cab = (front - 0.32 * length, front - 0.12 * length, 0.05 - side, side - 0.05)
    cab_top, box = (cab[0], cab[1] - 0.08 * length, *top[2:]), (back, front - 0.32 * length, -side, side)
    meshes = [
        frustum(flanks, flanks, (0.2, belt), (f.side, f.side, f.back, f.front, f.panel, f.under)),
        frustum(box, top, (belt, height), (f.side, f.side, f.glass, f.panel, f.panel, None)),
        frustum(cab, cab_top, (belt, height - 0.05), (f.glass, f.glass, None, f.glass, f.panel, None)),
    ]
    return [Part(Mesh.joined(meshes)), *_wheels(size_m, 0.34, f)]


def _truck(rng: np.random.Generator, size_m: Size, materials: Materials) -> list[Part]:
    length, width, height = size_m
    f = _finish(rng, size_m, Semantic.TRUCK, materials)
    front, back, side = 0.5 * length, -0.5 * length, 0.5 * width
    cabin = front - 2.0
    cab, cargo = (cabin, front, 0.05 - side, side - 0.05), (back, cabin - 0.3, -side, side)
    chassis, roof = (back + 0.1, front - 0.1, 0.2 - side, side - 0.2), (cabin, front - 0.25, *cab[2:])
    meshes = [
        frustum(chassis, chassis, (0.35, 0.8), [f.under] * 6),
        frustum(cab, cab, (0.5, 1.6), (f.panel, f.panel, f.panel, f.front, None, f.under)),
        frustum(cab, roof, (1.6, 0.85 * height), (f.glass, f.glass, f.panel, f.glass, f.panel, None)),
        frustum(cargo, cargo, (0.8, height), (f.side, f.side, f.back, f.panel, f.panel, f.under)),
    ]
    return [Part(Mesh.joined(meshes)), *_wheels(size_m, 0.45, f)]


def _limb(
    at_m: tuple[float, float, float], length_m: float, radius_m: float, material: int, turn: Turn
) -> Part:
    """A bar that hangs from a joint."""
    bar = cylinder((0, 0, -length_m), (0, 0, 0), (0.75 * radius_m, radius_m), material, material, 7)
    joint = np.zeros((4, 4))
    joint[:3, 3] = at_m
    return Part(bar, lambda way_m: turn(way_m) + joint)


def _swing(amplitude_rad: float, stride_m: float, phase: float) -> Turn:
    return lambda way_m: pitched((0, 0, 0), amplitude_rad * np.sin(2 * np.pi * way_m / stride_m + phase))


def _person(
    rng: np.random.Generator, height_m: float, kind: Semantic, materials: Materials
) -> tuple[list[Mesh], dict[str, int]]:
    """Trunk and head, standing, and the materials of the limbs."""
    shirt, legs, skin = (
        materials.add(paint.cloth(rng, tuple(rng.uniform(30, 220, 3))), kind, repeats=True),
        materials.add(paint.panel(rng, _DARK[int(rng.integers(len(_DARK)))]), kind),
        materials.add(paint.panel(rng, _SKIN[int(rng.integers(len(_SKIN)))]), kind),
    )
    hair = materials.add(paint.panel(rng, (46, 36, 30)), kind)
    hip, neck = 0.5 * height_m, 0.84 * height_m
    trunk = frustum((-0.1, 0.1, -0.15, 0.15), (-0.11, 0.11, -0.21, 0.21), (hip, neck), [shirt] * 6)
    head = ball((0.01, 0, 0.92 * height_m), (0.1, 0.085, 0.12), skin, 5)
    cap = ball((-0.02, 0, 0.945 * height_m), (0.105, 0.095, 0.105), hair, 5)
    return [trunk, head, cap], {"shirt": shirt, "legs": legs, "skin": skin}


def _pedestrian(rng: np.random.Generator, size_m: Size, materials: Materials) -> list[Part]:
    height = size_m[2]
    meshes, use = _person(rng, height, Semantic.PEDESTRIAN, materials)
    stride = 0.8 * height
    parts = [Part(Mesh.joined(meshes))]
    for side, phase in ((0.09, 0.0), (-0.09, np.pi)):
        leg, arm = _swing(0.5, stride, phase), _swing(0.45, stride, phase + np.pi)
        hip, shoulder = (0, side, 0.5 * height), (0, 2.7 * side, 0.82 * height)
        parts.append(_limb(hip, 0.5 * height, 0.085, use["legs"], leg))
        parts.append(_limb(shoulder, 0.4 * height, 0.055, use["shirt"], arm))
    return parts


def _bicycle(rng: np.random.Generator, size_m: Size, materials: Materials) -> list[Part]:
    """A bicycle with its rider."""
    length, _, height = size_m
    frame = materials.add(paint.panel(rng, _paint(rng)[0]), Semantic.BICYCLE)
    tyre = materials.add(paint.wheel(rng), Semantic.BICYCLE)
    dark = materials.add(paint.panel(rng, (26, 26, 28)), Semantic.BICYCLE)
    radius, axle = 0.34, 0.5 * length - 0.36
    bars = [
        ((-axle, 0, radius), (-0.1, 0, 0.3)),
        ((-0.1, 0, 0.3), (-0.3, 0, 0.9)),
        ((-0.1, 0, 0.3), (axle - 0.15, 0, 0.85)),
        ((-0.28, 0, 0.85), (axle - 0.15, 0, 0.85)),
        ((axle, 0, radius), (axle - 0.2, 0, 1.05)),
        ((axle - 0.2, -0.25, 1.05), (axle - 0.2, 0.25, 1.05)),
    ]
    rider, use = _person(rng, height - 0.12, Semantic.BICYCLE, materials)
    lean = pitched((-0.3, 0, 0.12), 0.3)
    lean[:3, 3] -= lean[:3, :3] @ [0, 0, 0.45 * height] - np.array([0, 0, 0.45 * height])
    meshes = [cylinder(a, b, (0.025, 0.025), frame, None, 5) for a, b in bars]
    meshes += [m.moved(lean) for m in rider]
    parts = [Part(Mesh.joined(meshes))]
    for x in (axle, -axle):
        wheel = cylinder((0, -0.02, 0), (0, 0.02, 0), (radius, radius), dark, tyre, 14)
        parts.append(Part(wheel, _rolling((x, 0, radius), radius)))
    bent, arm = pitched((0, 0, 0), -0.45), pitched((0, 0, 0), -1.0)
    for side, phase in ((0.1, 0.0), (-0.1, np.pi)):
        hip, shoulder = (-0.25, side, 0.52 * height), (0.02, 2.2 * side, 0.78 * height)
        pedal = _swing(0.35, 5.0, phase)
        parts.append(_limb(hip, 0.42 * height, 0.08, use["legs"], lambda way, p=pedal: p(way) @ bent))
        parts.append(_limb(shoulder, 0.36 * height, 0.05, use["shirt"], lambda _: arm))
    return parts
