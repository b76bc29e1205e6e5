"""Classes of pixels of a street."""

from enum import IntEnum


class StreetClass(IntEnum):
    """Classes of pixels. A rider belongs to the two-wheeler; what is fixed to the camera is the own car."""

    SKY = 0
    ROAD = 1
    MARKING = 2
    GROUND = 3
    """Other ground: sidewalk, grass, sand, tracks."""
    STRUCTURE = 4
    """Buildings, walls, fences, bridges, rails and whatever else is built."""
    VEGETATION = 5
    POLE = 6
    """Poles, lamps, signs, traffic lights."""
    VEHICLE = 7
    TWO_WHEELER = 8
    PERSON = 9
    OWN_CAR = 10


ROAD_USERS = (StreetClass.VEHICLE, StreetClass.TWO_WHEELER, StreetClass.PERSON)
"""What can move on its own."""

FLAT = (StreetClass.ROAD, StreetClass.MARKING, StreetClass.GROUND)
"""What lies on the ground: one surface, as far as depth goes."""
