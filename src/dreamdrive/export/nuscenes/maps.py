"""Maps of logs in the two ways of nuScenes: the map expansion, and a picture of the drivable area."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.datasets.nuscenes.maps import AREAS, LINES
from dreamdrive.datasets.nuscenes.tables import token
from dreamdrive.files.output import plain_name
from dreamdrive.scene.street.log import Log, LogMap

_PIXEL_M = 0.1
_REACH_M = 50.0
_MOST_PX = 20_000


def write_maps(logs: Sequence[Log], folder: Path, rows: list[dict[str, Any]]) -> None:
    """``maps/expansion/LOCATION.json`` where there is a map, and ``maps/TOKEN.png`` in any case.

    The picture has 10 pixels a metre and begins at x = 0, y = 0, as nuScenes has it: what lies below these is
    in the expansion alone. Drives of one location share its map, which is that of all of them.
    """
    (folder / "maps" / "expansion").mkdir(parents=True)
    for location in dict.fromkeys(log.location for log in logs):
        here = [log for log in logs if log.location == location]
        own = token("map", location)
        merged = _merged([log.map for log in here])
        name = f"maps/{own}.png"
        write_picture(folder / name, _picture(here, merged))
        of = [token(log.name, "log") for log in here]
        rows.append({"token": own, "log_tokens": of, "category": "semantic_prior", "filename": name})
        if merged:
            text = json.dumps(_expansion(merged), allow_nan=False)
            (folder / "maps" / "expansion" / f"{plain_name(location)}.json").write_text(text + "\n", "utf-8")


def _merged(maps: Sequence[LogMap]) -> LogMap:
    """All shapes of several maps of one place, each once."""
    areas = {name: tuple(p for each in maps for p in each.areas.get(name, ())) for name in AREAS}
    lines = {name: tuple(p for each in maps for p in each.lines.get(name, ())) for name in LINES}
    once = {name: tuple({p.outline.tobytes(): p for p in shapes}.values()) for name, shapes in areas.items()}
    return LogMap(
        once, {name: tuple({p.tobytes(): p for p in each}.values()) for name, each in lines.items()}
    )


def _picture(logs: Sequence[Log], map: LogMap) -> UInt8[np.ndarray, "h w"]:
    paths = np.concatenate([log.world_from_ego[:, :2, 3] for log in logs])
    outlines = [p.outline for p in map.areas.get("drivable_area", ())]
    reach = np.concatenate([paths + _REACH_M, *outlines]).max(axis=0)
    width, height = np.clip(np.ceil(reach / _PIXEL_M), 1, _MOST_PX).astype(int).tolist()
    mask = np.zeros((height, width), np.uint8)
    for polygon in map.areas.get("drivable_area", ()):
        cv2.fillPoly(mask, [_pixels(polygon.outline)], 255)
        for hole in polygon.holes:
            cv2.fillPoly(mask, [_pixels(hole)], 0)
    return mask[::-1]


def _pixels(points: Float[np.ndarray, "n 2"]) -> np.ndarray:
    return np.rint(points / _PIXEL_M - 0.5).astype(np.int32)


def _expansion(map: LogMap) -> dict[str, Any]:
    """The tables of a map expansion, version 1.3."""
    made: dict[str, Any] = {"version": "1.3", "node": [], "line": [], "polygon": []}
    made |= {name: [] for name in (*AREAS, *LINES, "traffic_light")}
    made |= {"arcline_path_3": {}, "connectivity": {}}
    for name, shapes in map.areas.items():
        for polygon in shapes:
            own = _polygon(made, polygon.outline, polygon.holes)
            several = {"polygon_tokens": [own]} if name == "drivable_area" else {"polygon_token": own}
            made[name].append({"token": f"{name}-{len(made[name])}", **several})
    for name, strokes in map.lines.items():
        for points in strokes:
            own = f"line-{len(made['line'])}"
            made["line"].append({"token": own, "node_tokens": _nodes(made, points)})
            made[name].append({"token": f"{name}-{len(made[name])}", "line_token": own})
    made["canvas_edge"] = [float(x) for x in _edge(made["node"])]
    return made


def _polygon(
    made: dict[str, Any], outline: Float[np.ndarray, "n 2"], holes: Sequence[Float[np.ndarray, "_ 2"]]
) -> str:
    own = f"polygon-{len(made['polygon'])}"
    row = {"token": own, "exterior_node_tokens": _nodes(made, outline)}
    made["polygon"].append(row | {"holes": [{"node_tokens": _nodes(made, hole)} for hole in holes]})
    return own


def _nodes(made: dict[str, Any], points: Float[np.ndarray, "n 2"]) -> list[str]:
    first = len(made["node"])
    made["node"] += [
        {"token": f"node-{first + k}", "x": float(x), "y": float(y)} for k, (x, y) in enumerate(points)
    ]
    return [f"node-{first + k}" for k in range(len(points))]


def _edge(nodes: list[dict[str, Any]]) -> tuple[float, float]:
    return max(max(node["x"] for node in nodes), 1.0), max(max(node["y"] for node in nodes), 1.0)
