"""Formats that hold a scene as it stands at one time: one file, or a numbered file for each time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.export.moving import moments_of
from dreamdrive.files.output import check_free, check_new_file, new_file, new_folder
from dreamdrive.progress import Progress
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene


@dataclass(frozen=True)
class Still:
    """A format of Gaussians at one time.

    Attributes:
        name: Of the format, for people.
        ending: Of its files.
        kind: Of a folder of them, see ``files.kinds``.
        encode: The bytes of a file.
    """

    name: str
    ending: str
    kind: str
    encode: Callable[[Gaussians], bytes]


def write_stills(
    scene: Scene,
    path: Path,
    still: Still,
    *,
    times_s: Sequence[float] | None,
    replace: bool,
    progress: Progress,
) -> None:
    """Write one file for a name with the ending of the format, else a folder.

    The single file holds everything as it is at the first time. The folder holds a file ``static``
    (what never moves) and ``frames/NNNN``, everything as it is at each time: a numbered sequence.

    Raises:
        InputError: The path cannot be written, or the times do not grow.
    """
    moments_s = moments_of(scene, times_s)
    if path.suffix.lower() == still.ending:
        check_new_file(path, replace)
        if times_s is not None and len(moments_s) != 1:
            raise InputError(
                f"{path} holds one moment, and {len(moments_s)} are asked for; give one, or a folder for all"
            )
        data = still.encode(scene.at(float(moments_s[0])))
        with new_file(path) as partial:
            partial.write_bytes(data)
        return
    check_free(path, replace, still.kind)
    with new_folder(path, replace=replace, kind=still.kind) as folder:
        static = scene.static_at(float(moments_s[0]))
        (folder / f"static{still.ending}").write_bytes(still.encode(static))
        (folder / "frames").mkdir()
        for i, t_s in enumerate(moments_s.tolist()):
            (folder / "frames" / f"{i:04d}{still.ending}").write_bytes(still.encode(scene.at(t_s)))
            progress(i + 1, len(moments_s))


def left_out_of_stills(scene: Scene, path: Path, still: Still) -> str:
    """What of a scene ``write_stills`` finds no place for, in a sentence."""
    alone = path.suffix.lower() == still.ending
    shown = "the scene at one time" if alone else "the scene at single times"
    parts = {
        "sky": scene.sky is not None,
        "exposure of the recording": scene.exposure is not None,
        "motion" if alone else "motion in between": scene.moves_per_frame or len(scene.dynamic) > 0,
    }
    missing = ", ".join(f"no {part}" for part, there in parts.items() if there)
    return f"{still.name} holds {shown}{': ' if missing else ''}{missing}."
