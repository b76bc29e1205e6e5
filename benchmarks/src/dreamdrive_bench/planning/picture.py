"""Scenarios as pictures from above, in a grid."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.tasks.plan import corners
from dreamdrive_bench.planning.driver import STEP_S
from dreamdrive_bench.planning.footprints import ego_rectangles, rectangles_of
from dreamdrive_bench.planning.scenario import Scenario

_PX_PER_M, _SHIFT = 9.0, 4
_AHEAD_M, _BEHIND_M, _BESIDE_M = 44.0, 8.0, 17.0
_AREAS = {
    "road": (205, 205, 208),
    "parking": (190, 190, 196),
    "sidewalk": (230, 225, 214),
    "crossing": (248, 248, 248),
}
_GRASS, _HOUSE, _LINE, _INK = (206, 224, 188), (184, 168, 156), (140, 140, 150), (40, 40, 40)
_ACTOR, _OTHER, _STEADY, _TRUE = (190, 90, 10), (90, 110, 150), (200, 20, 50), (20, 120, 50)


def draw_grid(scenarios: Sequence[Scenario], horizon_s: float, columns: int) -> UInt8[np.ndarray, "h w 3"]:
    """All scenarios, row by row, each as :func:`draw_scene` draws it."""
    panels = [draw_scene(scenario, horizon_s) for scenario in scenarios]
    panels += [np.full_like(panels[0], 255)] * (-len(panels) % columns)
    rows = [np.concatenate(panels[k : k + columns], axis=1) for k in range(0, len(panels), columns)]
    return np.concatenate(rows)


def draw_scene(scenario: Scenario, horizon_s: float) -> UInt8[np.ndarray, "h w 3"]:
    """RGB picture of a scenario, the ego's way up.

    Boxes are drawn at every second from the instant to the horizon, the later the paler: those of the
    conflict brown, others blue, the true ego green. Red is where it comes to if it goes straight on.
    """
    sheet = _Sheet(scenario.true_poses[0])
    layout = scenario.layout
    for area in layout.areas:
        sheet.fill([np.array(ring) for ring in (area.polygon, *area.holes)], _AREAS[area.kind])
    for line in layout.lines:
        sheet.stroke(np.array(line.points), _LINE, 1)
    for house in layout.buildings:
        sheet.fill([np.array(house.polygon)], _HOUSE)
    for prop in layout.props:
        sheet.fill([np.array(prop.at_m) + _circle(0.4)], (96, 150, 70))
    sheet.stroke(scenario.lane_m, (90, 170, 90), 1)
    seconds = np.arange(round(horizon_s) + 1)
    rectangles = rectangles_of(layout.boxes, scenario.instant_s + seconds.astype(float))
    for number, box in enumerate(layout.boxes):
        colour = _ACTOR if box.id in scenario.actors else _OTHER
        sheet.boxes(rectangles[:, number], colour)
    truth = scenario.true_poses[:: round(1 / STEP_S)][: len(seconds)]
    sheet.boxes(ego_rectangles(steady_poses(scenario, seconds.astype(float))), _STEADY)
    sheet.boxes(ego_rectangles(truth), _TRUE)
    sheet.stroke(scenario.true_poses[: round(horizon_s / STEP_S) + 1, :2], _TRUE, 2)
    sheet.write(scenario.name)
    return sheet.image


def steady_poses(scenario: Scenario, later_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 3"]:
    """Poses (T, 3) of the ego's reference point, if it goes straight on at its speed from the instant."""
    first, second = scenario.true_poses[:2]
    poses = np.tile(first, (len(later_s), 1))
    poses[:, :2] += later_s[:, None] * (second - first)[:2] / STEP_S
    return poses


class _Sheet:
    def __init__(self, ego: Float[np.ndarray, "3"]) -> None:
        self._ego = ego
        height, width = round((_AHEAD_M + _BEHIND_M) * _PX_PER_M), round(2 * _BESIDE_M * _PX_PER_M)
        self.image = np.full((height, width, 3), _GRASS, np.uint8)

    def _pixels(self, points: Float[np.ndarray, "n 2"]) -> np.ndarray:
        away, yaw = points - self._ego[:2], self._ego[2]
        ahead = np.cos(yaw) * away[:, 0] + np.sin(yaw) * away[:, 1]
        left = np.cos(yaw) * away[:, 1] - np.sin(yaw) * away[:, 0]
        at = np.column_stack([_BESIDE_M - left, _AHEAD_M - ahead]) * _PX_PER_M
        return np.rint(at * 2**_SHIFT).astype(np.int32)

    def fill(self, rings: Sequence[Float[np.ndarray, "_ 2"]], colour: tuple[int, int, int]) -> None:
        cv2.fillPoly(self.image, [self._pixels(ring) for ring in rings], colour, cv2.LINE_AA, _SHIFT)

    def stroke(self, points: Float[np.ndarray, "n 2"], colour: tuple[int, int, int], wide: int) -> None:
        cv2.polylines(self.image, [self._pixels(points)], False, colour, wide, cv2.LINE_AA, _SHIFT)

    def boxes(self, rectangles: Float[np.ndarray, "t 5"], colour: tuple[int, int, int]) -> None:
        """One road user at some times: filled at first, outlined and paler later."""
        outlines = corners(rectangles)
        self.fill([outlines[0]], colour)
        for number, outline in enumerate(outlines):
            paler = 1 - 0.22 * number
            tone = tuple(round(255 - (255 - c) * paler) for c in colour)
            self.stroke(np.concatenate([outline, outline[:1]]), (tone[0], tone[1], tone[2]), 2)
        nose = outlines[0][:2].mean(axis=0)
        self.stroke(np.stack([outlines[0].mean(axis=0), nose]), (255, 255, 255), 1)

    def write(self, text: str) -> None:
        cv2.putText(self.image, text, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, _INK, 1, cv2.LINE_AA)
        cv2.rectangle(self.image, (0, 0), (self.image.shape[1] - 1, self.image.shape[0] - 1), _INK, 1)


def _circle(radius_m: float) -> Float[np.ndarray, "n 2"]:
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    return radius_m * np.column_stack([np.cos(turn), np.sin(turn)])
