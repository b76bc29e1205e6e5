"""A network whose answers are made from the picture's own colours, so that what it sees is known."""

import torch
from torch import Tensor
from torch.nn import functional

from dreamdrive.scene.street.street_class import ROAD_USERS, StreetClass
from dreamdrive.street_network.prediction import Prediction

FOCAL, HORIZON, ROLL = 0.9, 0.05, 0.02
LEVEL = 20
"""Red is the class times this, green the depth in camera heights, blue the number of the road user."""


def reading(pictures: Tensor) -> Prediction:
    """Answers that hold for the pixel under the middle of each cell."""
    half, quarter = (functional.interpolate(pictures, scale_factor=s, mode="nearest") for s in (0.5, 0.25))
    red, green, _ = (255 * half).round().unbind(1)
    classes = functional.one_hot((red / LEVEL).round().long(), len(StreetClass)).permute(0, 3, 1, 2) * 20.0
    centre, offset = _road_users((255 * quarter).round())
    count = len(pictures)
    camera = torch.tensor([[FOCAL, 0, 0, 0, 0, 0, -3.0]]).repeat(count, 1)
    camera[:, 0] = camera[:, 0].log()
    camera[:, 1], camera[:, 2] = HORIZON, ROLL
    camera[:, 3:6] = -3
    log_depth = green.clamp(min=1).log()
    return Prediction(log_depth, torch.full_like(log_depth, -2), classes, centre, offset, camera, quarter)


def _road_users(cells: Tensor) -> tuple[Tensor, Tensor]:
    """Peaks at the mean places of numbered regions, and the way there in pixels of the picture."""
    count, _, height, width = cells.shape
    centre = torch.full((count, len(ROAD_USERS), height, width), -9.0)
    offset = torch.zeros(count, 2, height, width)
    for n, (red, _, blue) in enumerate(cells):
        for number in blue.unique()[1:]:
            rows, columns = torch.nonzero(blue == number, as_tuple=True)
            place = columns.float().mean(), rows.float().mean()
            # Scaling mixes colours at outlines.
            kind = StreetClass(round(float(red[rows, columns].median()) / LEVEL))
            if kind in ROAD_USERS:
                centre[n, ROAD_USERS.index(kind), int(place[1]), int(place[0])] = 3
            offset[n, 0, rows, columns] = 4 * (place[0] - columns)
            offset[n, 1, rows, columns] = 4 * (place[1] - rows)
    return centre, offset
