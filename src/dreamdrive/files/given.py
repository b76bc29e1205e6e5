"""Checks of files and folders that users name, made before anything slow is loaded."""

from pathlib import Path

from dreamdrive.errors import InputError

SCENE = "the folder that dreamdrive generate wrote"
CLIP = "a video or a folder of images"
DATASET = "a folder of a data set"
WORLD = "a folder of dreamdrive world make, or a layout"
CLIPS = "a folder of clips, or one clip"
TRUTH = (
    "a folder of dreamdrive world make, a layout as JSON, a folder with PandaSet's cameras.json, or one with "
    "poses.txt and meta.json"
)
_WEIGHTS = "a file of weights or its folder"
WANTED = {
    "input": CLIP,
    "intrinsics": "a calibration file",
    "poses": "a file with poses",
    "trajectory": "a file with poses",
    "trajectories": "a file with several paths",
    "features": "a .safetensors file, see docs/replay.md",
    "prior-weights": _WEIGHTS,
    "geometry-files": "cameras.json (ours or PandaSet's), transforms.json (nerfstudio), a COLMAP model "
    "(cameras, images and points3D as .bin or .txt) or poses.txt (KITTI or TUM)",
    "weights": _WEIGHTS,
    "knowledge": "weights of the street network",
    "fill": "network, inpaint or a file of weights",
    "options": "a TOML file, see docs/options.md",
    "edits": "edits.json of a scene that dreamdrive edit wrote",
    "layout": "a layout, see docs/layout.md",
    "cameras": "a file with poses and times, or the folder of a COLMAP model",
}
"""What the files of flags are expected to be, by their names without dashes."""


def check_there(path: Path | None, expected: str, flag: str = "") -> None:
    """Fail with what was expected where something that was named is not there; None was not named."""
    if path is not None and not path.exists():
        raise InputError(f"{flag} {path} does not exist; expected {expected}".strip())


def check_given(**files: Path | None) -> None:
    """``check_there`` for each file of a flag, named as in ``WANTED`` with underscores for dashes."""
    for name, path in files.items():
        flag = name.replace("_", "-")
        check_there(path, WANTED[flag], "" if flag == "input" else f"--{flag}")
