"""Trim: paint and fittings of a vehicle's body."""

from dataclasses import dataclass

from streetworld.edition2.layouts.variants import Colour
from streetworld.edition2.vehicles.parts.canvas import Place


def shaded(colour: Colour, share: float) -> Colour:
    """A colour, lighter or darker."""
    red, green, blue = (min(255.0, share * c) for c in colour)
    return red, green, blue


@dataclass(frozen=True)
class Letters:
    """Words on a side: each with its place and its height in metres."""

    words: list[tuple[str, Place, float]]
    ink: Colour


@dataclass(frozen=True)
class Trim:
    """Colours and fittings. Panes and doors are shares of the band of windows, from its front to its back.

    Attributes:
        colour, roof, low: Of the body, the roof, and the sills and lower bumpers.
        bumper: Of whole bumpers that differ from the body.
        panes: Side windows, from and to.
        pane_z: Their lower and upper edge as shares of the band of windows.
        joined_panes: Whether all lie in one black band.
        doors: Front doors and back doors: from, to, and whether it slides.
        tint, privacy: Of the glass, and how much darker that at the back is.
        see_through: How often a window shows light from the other side.
        head, tail, grille: Designs of lamps and grille.
        head_z, head_m: Heights of the headlamps, and how far they reach round the corner.
        lit, head_lit: Whether the tail lamps and the headlamps shine.
        plates: Colours of the number plates in front, None for none, and at the back.
        dirt: From 0 to 1.
        rows: Rows of windows: from and to in x and z, and how many.
        gates: Doors of a bus on the side where people board: from and to in x and z.
    """

    colour: Colour
    roof: Colour
    low: Colour
    panes: tuple[tuple[float, float], ...]
    doors: tuple[tuple[float, float, bool], ...]
    head: int
    tail: int
    grille: int
    head_z: tuple[float, float]
    plates: tuple[Colour | None, Colour]
    tint: Colour = (34, 38, 42)
    privacy: float = 0.7
    see_through: float = 0.7
    pane_z: tuple[float, float] = (0.07, 0.95)
    joined_panes: bool = True
    bumper: Colour | None = None
    sill_m: float = 0.1
    head_m: float = 0.3
    crease: float = 0.5
    clad: bool = False
    rubbing: bool = False
    chrome: bool = False
    handle: Colour = (30, 30, 32)
    handle_z: float | None = None
    lit: bool = False
    head_lit: bool = False
    dirt: float = 0.1
    sunroof: bool = False
    band: Colour | None = None
    band_z: tuple[float, float] = (0.0, 0.0)
    letters: Letters | None = None
    bed: Colour | None = None
    rear_window: bool = True
    split_doors: bool = False
    sign: str | None = None
    rows: tuple[tuple[float, float, float, float, int], ...] = ()
    gates: tuple[tuple[float, float, float, float], ...] = ()
    gates_right: bool = True
