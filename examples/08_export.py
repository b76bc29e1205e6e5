"""A scene in the formats of others: PLY, a web page, glTF, MCAP and nuScenes.

    python examples/08_export.py [SCENE] [--out DIR]

`ply` is for viewers of 3D Gaussians: what never moves, and a file for each time. `html` is a page that plays
the scene in a browser, `glb` the scene at its first time for engines. `mcap` is for Foxglove:
pictures, boxes and poses over time (extra `mcap`). `nuscenes` is a data set of one drive with pictures and
labels, as devkits read it, and as `generate` takes it in again. Each of them appears whole or not at all.

SCENE is a folder that `generate` wrote; without it a small one is made.
"""

import argparse
from pathlib import Path

from small import small_scene

from dreamdrive import load_scene
from dreamdrive.export import export


def main() -> None:
    """Write all of them."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("scene", nargs="?", type=Path)
    arguments.add_argument("--out", type=Path, default=Path("out/08_export"))
    given = arguments.parse_args()

    scene = load_scene((given.scene or small_scene(given.out.parent)) / "scene")
    for kind, name in {
        "ply": "ply",
        "html": "scene.html",
        "glb": "scene.glb",
        "mcap": "drive.mcap",
        "nuscenes": "nuscenes",
    }.items():
        path = given.out / name
        export(scene, kind, path)
        files = [path] if path.is_file() else [each for each in path.rglob("*") if each.is_file()]
        print(f"{path}: {len(files)} files, {sum(each.stat().st_size for each in files) / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
