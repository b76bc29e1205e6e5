"""A scene from a layout: map, boxes and path, and nothing else.

    python examples/04_drawn_street.py [--out DIR]

A layout is a JSON file with the areas of the road, the road users with their tracks, and the path of the
car. The prior `street-world` draws it, and what is drawn becomes a scene as a recording would. Here a car
stands at the kerb and another one comes towards us; take another number, and it drives elsewhere.

A third of a minute on two cores. The format: docs/layout.md.
"""

import argparse
import json
from pathlib import Path

from dreamdrive import Control, generate


def main() -> None:
    """Write a layout and make a scene of it."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--out", type=Path, default=Path("out/04_drawn_street"))
    out = arguments.parse_args().out

    file = out.parent / f"{out.name}.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(layout()))
    generate(Control(file, frames="0:12:1", size=(160, 96)), out, quality="draft")
    report = json.loads((out / "report.json").read_text())
    for actor in report["actors"]:
        print(f"vehicle {actor['id']} moves, as the decomposition found without knowing the layout")
    print(f"the layout is {file}, the scene {out / 'scene'}")


def layout() -> dict[str, object]:
    """A road of seven metres to the east, in the map's frame: x east, y north, metres."""
    houses = [
        {"polygon": [[x, y], [x + 12, y], [x + 12, y + 9], [x, y + 9]], "height_m": 9 + x % 5, "look": x % 7}
        for y in (8, -17)
        for x in range(0, 90, 14)
    ]
    return {
        "areas": [
            {"kind": "sidewalk", "polygon": rectangle(-20, 120, 6)},
            {"kind": "road", "polygon": rectangle(-20, 120, 3.5)},
        ],
        "lines": [{"kind": "lane_divider", "points": [[-20, 0], [120, 0]]}],
        "buildings": houses,
        "boxes": [
            box("parked", track=[at(0, 18, -2.8)]),
            box("oncoming", track=[at(0, 45, 1.75, yaw_rad=3.14159), at(2, 25, 1.75, yaw_rad=3.14159)]),
        ],
        "ego": {"track": [at(0, 0, -1.2), at(2, 16, -1.2)], "camera_height_m": 1.5},
    }


def rectangle(west_m: float, east_m: float, half_m: float) -> list[list[float]]:
    """Corners of a strip along the road."""
    return [[west_m, -half_m], [east_m, -half_m], [east_m, half_m], [west_m, half_m]]


def box(name: str, track: list[dict[str, float]]) -> dict[str, object]:
    """A car on a track."""
    return {"id": name, "kind": "car", "size_m": [4.4, 1.8, 1.5], "track": track}


def at(t_s: float, x_m: float, y_m: float, yaw_rad: float = 0.0) -> dict[str, float]:
    """Where something is at a time."""
    return {"t_s": t_s, "x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}


if __name__ == "__main__":
    main()
