"""How many frames a second the worlds are drawn at, with all truth."""

import time
from typing import Any

from dreamdrive_bench.street.case import FRAMES, RATE_HZ, SIZE
from streetworld import StreetOptions, World, draw_street, drive

ASKED = {"antialiased": 10.0, "one_ray": 20.0}
"""Frames a second that were asked for, at 320x192 on two cores."""


def frames_a_second(seed: int) -> dict[str, Any]:
    """Frames over seconds of the clock, the street being built; two frames are drawn side by side."""
    layout = draw_street(seed, StreetOptions(seconds=FRAMES / RATE_HZ))
    world = World(layout)
    drive(layout, 1, RATE_HZ, SIZE, world=world)  # what is made on first use
    found: dict[str, Any] = {"seed": seed, "size": SIZE}
    for name in ASKED:
        begin = time.perf_counter()
        drive(layout, FRAMES, RATE_HZ, SIZE, world=world, antialiased=name == "antialiased")
        found[name] = FRAMES / (time.perf_counter() - begin)
    return found
