"""Layouts on disk: JSON, checked field by field."""

import json
from pathlib import Path

import msgspec
import shapely

from dreamdrive.errors import InputError
from dreamdrive.scene.atomic import new_file
from dreamdrive.scene.layout import Layout


def read_layout(path: Path) -> Layout:
    """The layout in a JSON file.

    Raises:
        InputError: It cannot be read, or a field is missing, unknown, of the wrong type or out of range; the
            message names the field, as in ``$.boxes[2].size_m[0]``.
    """
    try:
        layout = msgspec.json.decode(path.read_bytes(), type=Layout)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; expected a layout as JSON") from error
    except msgspec.ValidationError as error:
        raise InputError(f"{path}: {error}; docs/layout.md says what a layout holds") from error
    except msgspec.DecodeError as error:
        raise InputError(f"{path} is no JSON: {error}") from error
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
    seen: set[str] = set()
    for i, box in enumerate(layout.boxes):
        if box.id in seen:
            found.append(f"$.boxes[{i}].id: {box.id!r} is taken by an earlier box; expected another name")
        seen.add(box.id)
    rings = [(f"$.areas[{i}].polygon", area.polygon, area.holes) for i, area in enumerate(layout.areas)]
    rings += [(f"$.buildings[{i}].polygon", house.polygon, []) for i, house in enumerate(layout.buildings)]
    for name, ring, holes in rings:
        polygon = shapely.Polygon(ring, holes)
        if not polygon.is_valid or polygon.area == 0:
            found.append(
                f"{name}: {shapely.is_valid_reason(polygon)}; expected an outline that does not cross itself"
            )
    return found
