"""Layouts on disk: JSON, checked field by field."""

import json
from pathlib import Path

import msgspec
import shapely

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json
from dreamdrive.files.output import new_file
from dreamdrive.scene.street.layout import Layout, Ring

MOST_BOXES = 255
"""Road users have labels of 8 bits, 0 for none."""


def read_layout(path: Path) -> Layout:
    """The layout in a JSON file; an error names the wrong field, as in ``$.boxes[2].size_m[0]``."""
    try:
        layout = of_type(read_json(path), Layout, str(path))
    except InputError as error:
        raise InputError(f"{error}; expected a layout as JSON, see docs/layout.md") from error
    for problem in problems(layout):
        raise InputError(f"{path}: {problem}")
    return layout


def write_layout(layout: Layout, path: Path) -> None:
    """Write it, whole or not at all; equal layouts give equal bytes."""
    text = msgspec.json.format(msgspec.json.encode(layout), indent=1).decode()
    with new_file(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def schema_text() -> str:
    """JSON Schema of a layout, as it is published."""
    return json.dumps(msgspec.json.schema(Layout), indent=2, sort_keys=True) + "\n"


def problems(layout: Layout) -> list[str]:
    """What types cannot say: each wrong field with what was expected."""
    found: list[str] = []
    tracks = [("$.ego.track", layout.ego.track)]
    tracks += [(f"$.boxes[{i}].track", box.track) for i, box in enumerate(layout.boxes)]
    for name, track in tracks:
        late = [i for i in range(1, len(track)) if track[i].t_s <= track[i - 1].t_s]
        found += [f"{name}[{i}].t_s: expected more than {track[i - 1].t_s:g}, the time before" for i in late]
    if len(layout.boxes) > MOST_BOXES:
        found.append(
            f"$.boxes: {len(layout.boxes)} boxes; expected at most {MOST_BOXES}, as many as labels of 8 bits"
        )
    seen: set[str] = set()
    for i, box in enumerate(layout.boxes):
        if box.id in seen:
            found.append(f"$.boxes[{i}].id: {box.id!r} is taken by an earlier box; expected another name")
        seen.add(box.id)
    for i, area in enumerate(layout.areas):
        found += _wrong_rings(f"$.areas[{i}]", area.polygon, area.holes)
    for i, house in enumerate(layout.buildings):
        found += _wrong_rings(f"$.buildings[{i}]", house.polygon, [])
    return found


def _wrong_rings(name: str, outline: Ring, holes: list[Ring]) -> list[str]:
    """Which rings of a polygon cross themselves, and which holes do not lie in it or lie in each other."""
    found = _crossing(f"{name}.polygon", outline)
    for j, hole in enumerate(holes):
        found += _crossing(f"{name}.holes[{j}]", hole)
    if found:
        return found
    whole = shapely.Polygon(outline)
    left = whole
    for j, hole in enumerate(holes):
        inner = shapely.Polygon(hole)
        if not whole.covers(inner):
            found.append(f"{name}.holes[{j}]: reaches out of the polygon; expected a hole inside it")
        elif left.intersection(inner).area < inner.area * (1 - 1e-9):
            found.append(f"{name}.holes[{j}]: overlaps an earlier hole; expected holes apart from each other")
        left = left.difference(inner)
    if not found and not shapely.Polygon(outline, holes).is_valid:
        reason = shapely.is_valid_reason(shapely.Polygon(outline, holes))
        found.append(f"{name}.holes: {reason}; expected holes that leave the polygon in one piece")
    return found


def _crossing(name: str, ring: Ring) -> list[str]:
    polygon = shapely.Polygon(ring)
    if polygon.is_valid and polygon.area > 0:
        return []
    return [f"{name}: {shapely.is_valid_reason(polygon)}; expected an outline that does not cross itself"]
