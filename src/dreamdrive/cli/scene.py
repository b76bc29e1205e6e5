"""Finding what ``generate`` wrote, and what is asked of it."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from dreamdrive.errors import InputError
from dreamdrive.files.given import SCENE, check_there
from dreamdrive.files.paths import inside

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from jaxtyping import UInt8

    from dreamdrive.scene.scene import Scene

    Frame = UInt8[np.ndarray, "h w 3"]


def open_scene(out: Path) -> "Scene":
    """The scene in an output folder of ``generate``, or in a scene folder itself."""
    from dreamdrive.stored import load_scene

    check_there(out, SCENE)
    if (out / "scene.json").is_file():
        return load_scene(out)
    if not (out / "scene").is_dir():
        unfinished = (
            " (it is unfinished: run the same generate command again)" if (out / "stages").is_dir() else ""
        )
        raise InputError(f"{out} holds no scene{unfinished}; expected {SCENE}")
    return load_scene(inside(out, "scene"))


def less(scene: "Scene", ids: tuple[int, ...]) -> "Scene":
    """The scene less some of its actors."""
    for id in dict.fromkeys(ids):
        try:
            scene = scene.without(id)
        except ValueError as error:
            raise InputError(f"--without: {error}") from error
    return scene


def blurring() -> "Callable[[Frame], Frame]":
    """What makes heads and plates coarse in a picture, with the network that ships."""
    from dreamdrive.street_network import SHIPPED, blur, load_knowledge

    return partial(blur, network=load_knowledge(SHIPPED))
