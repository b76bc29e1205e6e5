"""Parts of your own, in a file of your own: a backend of splatting, and a figure.

    python examples/12_own_parts.py [SCENE] [--out DIR]

What is chosen by name stands in a table. `BACKENDS` of splatting is one: a function from `SplatArguments`
to the images, whose gradients torch follows. This one shows each Gaussian smaller than it is, so that one
sees what a surface is made of. A figure is any function of two pictures. Priors, geometry methods and data
sets of other packages come in by entry points, without an import of theirs: docs/extending.md.

SCENE is a folder that `generate` wrote; without it a small one is made.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from small import small_scene
from torch import Tensor

from dreamdrive import load_scene
from dreamdrive.show import write_png
from dreamdrive.splat import BACKENDS, render


def shrunk(arguments):
    """The images of the native core, of Gaussians of a third of their size."""
    return BACKENDS["native"](replace(arguments, scales=arguments.scales / 3))


def edges_kept(picture: Tensor, other: Tensor) -> float:
    """How much of the gradient of one picture another one has, from 0 to 1."""
    steps = [np.abs(np.diff(each.numpy(), axis=1)) for each in (picture, other)]
    return float(np.minimum(*steps).sum() / steps[0].sum())


def main() -> None:
    """Draw one view with both backends, and compare."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("scene", nargs="?", type=Path)
    arguments.add_argument("--out", type=Path, default=Path("out/12_own_parts"))
    given = arguments.parse_args()

    scene = load_scene((given.scene or small_scene(given.out.parent)) / "scene")
    gaussians, camera = scene.at(float(scene.times_s[0])), scene.cameras[0]
    BACKENDS["shrunk"] = shrunk
    pictures = {name: render(gaussians, camera, backend=name).colour for name in ("native", "shrunk")}
    given.out.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures.items():
        write_png(given.out / f"{name}.png", np.rint(picture.clamp(0, 1).numpy() * 255).astype(np.uint8))
    print(
        f"edges kept: {edges_kept(pictures['native'], pictures['shrunk']):.2f}; pictures are in {given.out}"
    )


if __name__ == "__main__":
    main()
