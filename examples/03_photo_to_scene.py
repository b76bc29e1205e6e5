"""One photo becomes a street that can be driven into, along two ways.

    python examples/03_photo_to_scene.py [PHOTO] [--out DIR]

The prior `photo` makes layers of what the street network sees in a picture, and draws what a camera would
see on its way into it. Each action is a drive of its own, and all become one scene. What no picture shows
is made up, so views hold a few metres ahead and aside.

Without a photo a picture of the small street is used. Half a minute on two cores.
"""

import argparse
from pathlib import Path

from small import small_street

from dreamdrive import Control, generate, load_scene
from dreamdrive.scene.control import Command


def main() -> None:
    """Drive into a photo, straight on and to the left."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("photo", nargs="?", type=Path)
    arguments.add_argument("--out", type=Path, default=Path("out/03_photo_to_scene"))
    given = arguments.parse_args()

    photo = given.photo or small_street(given.out.parent) / "frames/0000.png"
    actions = Command("forward"), Command("left")
    control = Control(photo, actions=actions, frames="0:10:1", size=(160, 96))
    outcome = generate(control, given.out, quality="draft", camera_height_m=1.5)

    scene = load_scene(given.out / "scene")
    print(f"{outcome.frames} frames were drawn from {photo}, on {len(actions)} ways")
    print(
        f"{len(scene.static)} static and {len(scene.dynamic)} moving Gaussians; videos: {given.out / 'video'}"
    )


if __name__ == "__main__":
    main()
