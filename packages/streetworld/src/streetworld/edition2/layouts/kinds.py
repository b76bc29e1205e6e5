"""Kinds of streets: how wide their roads are, how they wind, and what stands beside them."""

from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from dreamdrive.scene.street.layout import BarrierKind
from streetworld.edition2.roads.roads import Middle, Parking
from streetworld.options import StreetKind

Range = tuple[float, float]
Choice = TypeVar("Choice")


@dataclass(frozen=True)
class StreetRecipe:
    """What streets of a kind are drawn from: ranges in metres, chances, and shares of choices.

    ``share`` is how often the kind is drawn. Speeds are those of free traffic in metres a second; ``block_m``
    is from one junction to the next, None for none. ``estate`` is what bounds the ground beside the road.
    Chances of trees, bushes, lamps and masts are those a place is taken; ``walkers`` go within sight.
    """

    share: float
    lanes: tuple[int, int]
    lane_m: Range
    speed_m_s: Range
    middles: dict[Middle, float]
    one_way: float = 0.0
    shoulder_m: Range = (0.0, 0.3)
    parkings: dict[Parking, float] = field(default_factory=lambda: {"none": 1.0})
    walk: float = 1.0
    walk_m: Range = (1.5, 4.0)
    verge: float = 0.1
    radius_m: Range = (60.0, 600.0)
    winding: float = 0.4
    block_m: Range | None = (45.0, 130.0)
    houses: float = 0.9
    setback_m: Range = (0.3, 3.0)
    height_m: Range = (6.0, 18.0)
    wide_m: Range = (9.0, 18.0)
    estate: dict[BarrierKind | None, float] = field(default_factory=lambda: {None: 1.0})
    rail: float = 0.0
    trees: float = 0.4
    wood: float = 0.0
    bushes: float = 0.1
    lamps: float = 0.8
    masts: float = 0.1
    walkers: tuple[int, int] = (2, 14)
    marked: float = 0.9
    edges: float = 0.2


KINDS: dict[StreetKind, StreetRecipe] = {
    "city": StreetRecipe(
        share=0.2,
        lanes=(1, 4),
        lane_m=(2.9, 3.5),
        speed_m_s=(6, 13),
        middles={"dashed": 0.2, "solid": 0.6, "paved": 0.2},
        one_way=0.25,
        parkings={"none": 0.4, "parallel": 0.5, "angled": 0.1},
        walk_m=(2.0, 6.0),
        radius_m=(80.0, 500.0),
        winding=0.25,
        block_m=(35.0, 110.0),
        height_m=(8.0, 60.0),
        wide_m=(12.0, 35.0),
        walkers=(5, 26),
    ),
    "town": StreetRecipe(
        share=0.2,
        lanes=(1, 2),
        lane_m=(2.7, 3.4),
        speed_m_s=(5, 11),
        middles={"none": 0.3, "dashed": 0.4, "solid": 0.3},
        one_way=0.2,
        parkings={"none": 0.3, "parallel": 0.5, "angled": 0.1, "perpendicular": 0.1},
        radius_m=(30.0, 300.0),
        winding=0.5,
        height_m=(5.0, 18.0),
        marked=0.75,
    ),
    "suburb": StreetRecipe(
        share=0.14,
        lanes=(1, 1),
        lane_m=(2.6, 3.6),
        speed_m_s=(5, 11),
        middles={"none": 0.6, "dashed": 0.3, "solid": 0.1},
        parkings={"none": 0.5, "parallel": 0.5},
        walk=0.8,
        walk_m=(1.2, 2.2),
        verge=0.5,
        radius_m=(25.0, 250.0),
        winding=0.6,
        houses=0.85,
        setback_m=(4.0, 11.0),
        height_m=(4.0, 8.5),
        wide_m=(8.0, 16.0),
        estate={None: 0.3, "hedge": 0.3, "fence": 0.25, "wall": 0.15},
        trees=0.5,
        wood=0.35,
        bushes=0.35,
        lamps=0.6,
        masts=0.4,
        walkers=(0, 7),
        marked=0.45,
    ),
    "avenue": StreetRecipe(
        share=0.12,
        lanes=(2, 4),
        lane_m=(3.0, 3.6),
        speed_m_s=(9, 17),
        middles={"grass": 0.4, "paved": 0.35, "rail": 0.15, "solid": 0.1},
        shoulder_m=(0.2, 1.2),
        parkings={"none": 0.7, "parallel": 0.3},
        walk_m=(2.0, 5.0),
        verge=0.4,
        radius_m=(120.0, 800.0),
        block_m=(70.0, 200.0),
        houses=0.6,
        setback_m=(1.0, 12.0),
        height_m=(5.0, 35.0),
        wide_m=(14.0, 40.0),
        rail=0.1,
        trees=0.6,
        wood=0.2,
        walkers=(0, 10),
    ),
    "alley": StreetRecipe(
        share=0.06,
        lanes=(1, 1),
        lane_m=(3.0, 4.5),
        speed_m_s=(2, 6),
        middles={"none": 1.0},
        one_way=0.8,
        walk=0.25,
        walk_m=(0.8, 1.4),
        radius_m=(20.0, 150.0),
        winding=0.5,
        block_m=(30.0, 80.0),
        houses=0.8,
        setback_m=(0.1, 1.0),
        height_m=(3.5, 14.0),
        wide_m=(6.0, 16.0),
        estate={"wall": 0.8, "fence": 0.2},
        trees=0.05,
        wood=0.15,
        lamps=0.3,
        masts=0.4,
        walkers=(1, 8),
        marked=0.1,
    ),
    "country": StreetRecipe(
        share=0.12,
        lanes=(1, 1),
        lane_m=(2.3, 3.7),
        speed_m_s=(10, 24),
        middles={"none": 0.3, "dashed": 0.4, "solid": 0.3},
        shoulder_m=(0.0, 1.5),
        walk=0.0,
        radius_m=(35.0, 500.0),
        winding=0.7,
        block_m=(120.0, 500.0),
        houses=0.1,
        setback_m=(4.0, 25.0),
        height_m=(3.5, 9.0),
        wide_m=(8.0, 18.0),
        estate={None: 0.55, "fence": 0.2, "hedge": 0.15, "wall": 0.1},
        rail=0.25,
        trees=0.25,
        wood=0.6,
        bushes=0.35,
        lamps=0.06,
        masts=0.5,
        walkers=(0, 2),
        marked=0.65,
        edges=0.6,
    ),
    "motorway": StreetRecipe(
        share=0.08,
        lanes=(2, 5),
        lane_m=(3.4, 3.75),
        speed_m_s=(18, 30),
        middles={"rail": 0.8, "grass": 0.2},
        shoulder_m=(1.5, 3.2),
        walk=0.0,
        radius_m=(350.0, 1500.0),
        block_m=None,
        houses=0.0,
        estate={None: 0.6, "wall": 0.25, "fence": 0.15},
        rail=0.75,
        trees=0.0,
        wood=0.5,
        bushes=0.2,
        lamps=0.3,
        walkers=(0, 0),
        marked=1.0,
        edges=1.0,
    ),
    "industrial": StreetRecipe(
        share=0.05,
        lanes=(1, 2),
        lane_m=(3.2, 4.0),
        speed_m_s=(7, 13),
        middles={"none": 0.3, "dashed": 0.4, "solid": 0.3},
        shoulder_m=(0.0, 1.0),
        parkings={"none": 0.6, "parallel": 0.2, "perpendicular": 0.2},
        walk=0.6,
        verge=0.4,
        radius_m=(80.0, 500.0),
        winding=0.3,
        block_m=(70.0, 180.0),
        houses=0.65,
        setback_m=(3.0, 20.0),
        height_m=(5.0, 14.0),
        wide_m=(20.0, 50.0),
        estate={"fence": 0.6, "wall": 0.2, None: 0.2},
        trees=0.2,
        wood=0.15,
        lamps=0.6,
        masts=0.4,
        walkers=(0, 3),
        marked=0.7,
    ),
    "parking": StreetRecipe(
        share=0.03,
        lanes=(1, 1),
        lane_m=(2.8, 3.4),
        speed_m_s=(2, 5),
        middles={"none": 1.0},
        parkings={"perpendicular": 0.7, "angled": 0.3},
        walk=0.0,
        winding=0.0,
        block_m=None,
        houses=0.5,
        setback_m=(3.0, 10.0),
        height_m=(5.0, 20.0),
        wide_m=(18.0, 45.0),
        trees=0.15,
        wood=0.1,
        lamps=0.5,
        walkers=(1, 10),
        marked=0.9,
    ),
}


def chosen(rng: np.random.Generator, shares: dict[Choice, float]) -> Choice:
    """One of some things, each by its share."""
    ends = np.cumsum(list(shares.values()))
    return list(shares)[int(np.searchsorted(ends, rng.random() * ends[-1], side="right"))]
