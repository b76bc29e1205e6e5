"""Joining of the parts of one vehicle that each have a centre of their own."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt16
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from dreamdrive.scene.street.look import RoadUser
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.street_network.grouping import free, measured, outlined

_NOTHING_M = 1e-3  # or in any unit; in the sky there is no depth


@dataclass(frozen=True)
class JoiningOptions:
    """Which neighbours are parts of one vehicle.

    A lorry that fills half of the picture has several centres: of its box, its cab, a wheel. Parts lie above
    one another, and depth goes on from one to the next; of two vehicles the one behind is farther away.
    """

    step: float = 0.04
    """Most that the logarithm of depth changes across their border: a median."""
    apart: float = 0.6
    """Most that the medians of their logarithms of depth differ."""
    beside: float = 0.3
    """Most that their middles are beside each other, as a share of their mean width."""
    border_px: int = 4
    """Least border, in pairs of pixels."""


def joined(
    numbers: UInt16[np.ndarray, "h w"],
    road_users: tuple[RoadUser, ...],
    depth: Float[np.ndarray, "h w"],
    classes: Int[np.ndarray, "h w"],
    options: JoiningOptions,
    closing: float,
) -> tuple[UInt16[np.ndarray, "h w"], tuple[RoadUser, ...]]:
    """Road users of one frame with the parts of each vehicle as one, by falling score.

    ``numbers`` are 1 + index into ``road_users``, 0 where there is none; depth is in any unit. A vehicle of
    several parts has its outline closed, see ``outlined``, by that share and as far as the classes are free.
    """
    count = len(road_users)
    pairs = _pairs(numbers, road_users, depth, options)
    if not len(pairs):
        return numbers, road_users
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    _, whole = connected_components(graph, directed=False)
    # Road users are by falling score: the first part of each stands for all.
    _, first, part_of = np.unique(whole, return_index=True, return_inverse=True)
    first_of = first[part_of]
    kept = np.unique(first_of)
    number_of = np.concatenate([[0], 1 + np.searchsorted(kept, first_of)]).astype(np.uint16)
    numbers = number_of[numbers]
    found: list[RoadUser] = []
    for number, index in enumerate(kept.tolist(), start=1):
        user = road_users[index]
        if (first_of == index).sum() > 1:
            own = numbers == number
            numbers[outlined(own, closing) & free(classes)] = number
            user = measured(user.kind, user.score, numbers == number)
        found.append(user)
    return numbers, tuple(found)


def _pairs(
    numbers: UInt16[np.ndarray, "h w"],
    road_users: tuple[RoadUser, ...],
    depth: Float[np.ndarray, "h w"],
    options: JoiningOptions,
) -> Int[np.ndarray, "p 2"]:
    """Indices of vehicles that are parts of one."""
    vehicle = np.array([False, *(user.kind == StreetClass.VEHICLE for user in road_users)])
    log_depth = np.log(np.maximum(depth, _NOTHING_M))
    first, second = (np.concatenate(sides) for sides in zip(*_sides(numbers), strict=True))
    of_first, of_second = (np.concatenate(sides) for sides in zip(*_sides(log_depth), strict=True))
    border = (first != second) & vehicle[first] & vehicle[second]
    ends = np.sort(np.stack([first[border], second[border]], axis=1).astype(np.intp) - 1, axis=1)
    steps = np.abs(of_first - of_second)[border]
    found: list[tuple[int, int]] = []
    for one, other in np.unique(ends, axis=0).tolist():
        between = steps[(ends == (one, other)).all(axis=1)]
        if len(between) < options.border_px or np.median(between) >= options.step:
            continue
        middles = [np.median(log_depth[numbers == 1 + index]) for index in (one, other)]
        if abs(middles[0] - middles[1]) < options.apart and _beside(numbers, one, other) < options.beside:
            found.append((one, other))
    return np.array(found, np.intp).reshape(-1, 2)


def _sides(image: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Values of all pixels and of their neighbours to the right, and of all and those below."""
    return [
        (image[:, :-1].ravel(), image[:, 1:].ravel()),
        (image[:-1].ravel(), image[1:].ravel()),
    ]


def _beside(numbers: UInt16[np.ndarray, "h w"], one: int, other: int) -> float:
    """Distance of the middles along a row over the mean width."""
    columns = [np.nonzero(numbers == 1 + index)[1] for index in (one, other)]
    width_px = float(np.mean([np.ptp(each) + 1 for each in columns]))
    return abs(float(columns[0].mean() - columns[1].mean())) / width_px
