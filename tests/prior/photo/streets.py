"""A street whose every pixel is known: a level road, a wall across it, a car before the wall."""

import numpy as np

from dreamdrive.prior.photo.street import PhotoStreet
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.street.street_class import StreetClass

WIDTH, HEIGHT, FOCAL_PX, HEIGHT_M = 96, 54, 80.0, 1.5
WALL_M, CAR_M = 30.0, 10.0
CAR = (slice(27, 39), slice(40, 56))
GROUND = Ground(np.array([0.0, -1.0, 0.0]), HEIGHT_M)


def street() -> PhotoStreet:
    camera = Camera(FOCAL_PX, FOCAL_PX, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT)
    plane = GROUND.depth_m(camera)
    road = plane < WALL_M
    classes = np.full((HEIGHT, WIDTH), StreetClass.STRUCTURE, np.uint8)
    classes[road] = StreetClass.ROAD
    classes[:10] = StreetClass.SKY
    depth = np.minimum(plane, WALL_M).astype(np.float32)
    depth[:10] = 0
    rgb = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
    rgb[classes == StreetClass.STRUCTURE] = (150, 60, 40)
    rgb[classes == StreetClass.SKY] = (120, 160, 230)
    road_users = np.zeros((HEIGHT, WIDTH), np.uint16)
    road_users[CAR], classes[CAR], depth[CAR], rgb[CAR] = 1, StreetClass.VEHICLE, CAR_M, (20, 20, 200)
    return PhotoStreet(rgb, camera, depth, classes, road_users, GROUND)
