"""A layout as a picture from above."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.scene.street.layout import Layout, Point, TrackPoint, is_moving, track_function

_SIZE_PX = 1000
_MARGIN_M = 8.0
_REACH_M = 60.0
_AREAS = {
    "road": (196, 196, 200),
    "parking": (182, 182, 190),
    "sidewalk": (226, 220, 208),
    "crossing": (250, 250, 250),
    "grass": (206, 224, 188),
}
_LINES = {
    "lane_divider": (120, 120, 130),
    "road_divider": (214, 160, 30),
    "road_edge": (120, 120, 130),
    "stop_line": (200, 40, 40),
}
_BOXES = {
    "car": (36, 92, 180),
    "van": (90, 60, 170),
    "truck": (140, 60, 110),
    "bicycle": (20, 140, 90),
    "pedestrian": (200, 90, 20),
    "bus": (170, 40, 140),
    "motorcycle": (20, 120, 130),
}
_PROPS = {
    "tree": (96, 150, 70),
    "lamp": (120, 120, 120),
    "sign": (200, 60, 60),
    "bush": (120, 165, 80),
    "mast": (110, 96, 80),
    "traffic_light": (220, 150, 20),
    "bin": (90, 100, 90),
    "cone": (230, 100, 30),
}
_BARRIERS = {
    "fence": (150, 120, 90),
    "hedge": (80, 130, 60),
    "wall": (110, 100, 96),
    "rail": (90, 96, 110),
}
_PARKED, _EGO, _INK = (130, 136, 146), (210, 30, 60), (40, 40, 40)
_SHIFT = 4


def draw_layout(layout: Layout, seconds: float) -> UInt8[np.ndarray, "h w 3"]:
    """RGB picture, east to the right: map, houses, boxes at time 0, their ways for ``seconds``, the car's."""
    return _Sheet(layout, seconds).draw()


class _Sheet:
    def __init__(self, layout: Layout, seconds: float) -> None:
        self.layout = layout
        self.times = np.linspace(0, seconds, 25)
        path = _way(layout.ego.track, self.times)
        low, high = path.min(0) - _REACH_M / 2, path.max(0) + _REACH_M / 2
        yaw = layout.ego.track[-1].yaw_rad
        ahead = np.array([np.cos(yaw), np.sin(yaw)]) * _REACH_M / 2
        low, high = np.minimum(low, low + ahead) - _MARGIN_M, np.maximum(high, high + ahead) + _MARGIN_M
        self.scale = _SIZE_PX / float((high - low).max())
        self.corner = np.array([low[0], high[1]])
        width, height = np.ceil((high - low) * self.scale).astype(int)
        self.image = np.full((height, width, 3), _AREAS["grass"], dtype=np.uint8)

    def draw(self) -> UInt8[np.ndarray, "h w 3"]:
        layout = self.layout
        for area in layout.areas:
            self._fill([area.polygon, *area.holes], _AREAS[area.kind])
        for line in layout.lines:
            self._stroke(line.points, _LINES[line.kind], 1)
        for house in layout.buildings:
            self._fill([house.polygon], (184, 168, 156))
            self._stroke([*house.polygon, house.polygon[0]], (120, 104, 94), 1)
        for barrier in layout.barriers:
            self._stroke(barrier.points, _BARRIERS[barrier.kind], 2)
        for prop in layout.props:
            radius = int((1.6 if prop.kind == "tree" else 0.4) * self.scale * 2**_SHIFT)
            centre = self._pixels([prop.at_m])[0].tolist()
            cv2.circle(self.image, centre, radius, _PROPS[prop.kind], -1, cv2.LINE_AA, _SHIFT)
        for box in layout.boxes:
            moving = is_moving(box.track)
            if moving:
                self._stroke(_way(box.track, self.times), _BOXES[box.kind], 2)
            self._outline(box.track, box.size_m[0], box.size_m[1], _BOXES[box.kind] if moving else _PARKED)
            self._name(box.id, box.track)
        self._stroke(_way(layout.ego.track, self.times), _EGO, 3)
        self._outline(layout.ego.track, 4.6, 1.9, _EGO)
        self._scale_bar()
        return self.image

    def _pixels(self, points: Sequence[Point] | np.ndarray) -> np.ndarray:
        at = (np.asarray(points, dtype=np.float64) - self.corner) * [1, -1] * self.scale - 0.5
        return np.rint(at * 2**_SHIFT).astype(np.int32)

    def _fill(self, rings: Sequence[Sequence[Point] | np.ndarray], colour: tuple[int, int, int]) -> None:
        cv2.fillPoly(self.image, [self._pixels(ring) for ring in rings], colour, cv2.LINE_AA, _SHIFT)

    def _stroke(self, points: Sequence[Point] | np.ndarray, colour: tuple[int, int, int], width: int) -> None:
        cv2.polylines(self.image, [self._pixels(points)], False, colour, width, cv2.LINE_AA, _SHIFT)

    def _outline(
        self, track: list[TrackPoint], length_m: float, width_m: float, colour: tuple[int, int, int]
    ) -> None:
        """A rectangle at time 0 with a line from its middle to its front."""
        x, y, yaw = track_function(track)(np.zeros(1))[0]
        turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        corners = 0.5 * np.array(
            [[length_m, width_m], [-length_m, width_m], [-length_m, -width_m], [length_m, -width_m]]
        )
        self._fill([corners @ turn + [x, y]], colour)
        self._stroke(np.array([[0.0, 0], [0.5 * length_m, 0]]) @ turn + [x, y], (255, 255, 255), 1)

    def _name(self, text: str, track: list[TrackPoint]) -> None:
        x, y, _ = track_function(track)(np.zeros(1))[0]
        self._write(text, (self._pixels([(x + 1.2, y + 1.2)])[0] // 2**_SHIFT).tolist(), 0.36)

    def _write(self, text: str, place: Sequence[int], size: float) -> None:
        cv2.putText(self.image, text, place, cv2.FONT_HERSHEY_SIMPLEX, size, _INK, 1, cv2.LINE_AA)

    def _scale_bar(self) -> None:
        height = self.image.shape[0]
        cv2.line(self.image, (14, height - 14), (14 + round(10 * self.scale), height - 14), _INK, 2)
        self._write("10 m", (14, height - 20), 0.45)


def _way(track: list[TrackPoint], times_s: np.ndarray) -> np.ndarray:
    """X and y (T, 2) at some times."""
    return track_function(track)(times_s)[:, :2]
