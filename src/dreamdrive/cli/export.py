"""``dreamdrive export``: a scene in another program's format."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, UseAppendAction, arg

from dreamdrive.cli.scene import blurring, less, open_scene
from dreamdrive.cli.terminal.arguments import ExportName, parse_times
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.errors import InputError
from dreamdrive.export import EXPORTS, Export, function
from dreamdrive.files.given import DATASET, SCENE, check_there
from dreamdrive.scene.control import check_numbers

if TYPE_CHECKING:
    from dreamdrive.export import Labels
    from dreamdrive.scene.clip import Clip
    from dreamdrive.scene.geometry import Geometry
    from dreamdrive.scene.scene import Scene

_OF_WORLD = "Pictures, poses and boxes are those of the drawn street."
_LATE_S = 1e-6


@dataclass(frozen=True)
class _Asked:
    """What is asked for beside the format."""

    trajectory: str | None
    shift_m: float
    fps: float | None
    without: tuple[int, ...]
    times_s: tuple[float, ...] | None
    blur: bool
    labels: Path | None

    @property
    def changed(self) -> bool:
        """Whether the views are others than the recorded ones."""
        return self.trajectory is not None or bool(self.without)

    @property
    def options(self) -> dict[str, bool]:
        """Which of those are asked for that not every format takes."""
        return {
            "trajectory": self.trajectory is not None,
            "times": self.times_s is not None,
            "blur": self.blur,
            "labels": self.labels is not None,
        }


def export(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    to: ExportName,
    output: Annotated[Path, arg(aliases=["-o"], metavar="FILE|DIR")],
    trajectory: Annotated[str | None, arg(metavar="NAME|FILE", help_behavior_hint="")] = None,
    shift_m: Annotated[float, arg(metavar="M")] = 2.0,
    fps: Annotated[float | None, arg(metavar="F", help_behavior_hint="")] = None,
    without: Annotated[UseAppendAction[tuple[int, ...]], arg(metavar="ID", help_behavior_hint="")] = (),
    times: Annotated[str | None, arg(metavar="S|FIRST:LAST:STEP", help_behavior_hint="")] = None,
    blur: bool = False,
    labels: Annotated[Path | None, arg(metavar="DATASET", help_behavior_hint="")] = None,
    force: bool = False,
) -> None:
    """Write a scene or a drawn street in a format that other programs read.

    Args:
        out: The folder that generate wrote; for nuscenes, ncore and mcap also one of world make.
        to: ply is what viewers of 3D Gaussians read; nuscenes a data set with pictures, labels and lidar;
            ncore the clip with its poses for NuRec, 3dgrut and gsplat; mcap the drive for Foxglove; colmap
            and nerfstudio the frames with cameras and points; tum the path of the first camera; depth and
            flow metres and motion of every pixel as KITTI writes them; mesh road and standing surfaces as
            triangles; spz, glb and sog Gaussians at one time or more, usd and 4dgs over time; html a page
            that plays the scene.
        output: For ply NAME.ply for everything at one time, the first recorded one; else a folder for
            static.ply and, with everything at each time, frames/NNNN.ply; spz, glb and sog likewise. For mcap
            NAME.mcap, tum NAME.txt, mesh NAME.ply or NAME.glb, usd NAME.usdc, 4dgs NAME.4dgs, html
            NAME.html; for the others a folder.
        trajectory: Along a new drive in place of the recorded one, rendered: forward, left, right, stop,
            lane-left, lane-right, shift, or a file with a trajectory. For formats with cameras.
        shift_m: How far shift goes to the right in metres; negative is to the left.
        fps: Frames a second of the new drive; without it a file's own, and for the others 20 at least.
        without: Leave a moving thing out, by the id that scene.json gives it. It may be given several times.
        times: Moments of the scene, for formats of Gaussians: seconds, several with commas, or the first, the
            last and the step; without it the recorded ones.
        blur: Make heads of people and plates of vehicles coarse in all pictures, as far as the street network
            finds them.
        labels: The data set of the drive that a scene was made of: for nuscenes, boxes and map of what the
            scene does not hold as actors are those of the drive.
        force: Replace what is there already, if dreamdrive wrote it.
    """
    check_there(out, SCENE)
    chosen = EXPORTS.choose(to)
    moments_s = None if times is None else parse_times(times)
    asked = _Asked(trajectory, shift_m, fps, without, moments_s, blur, labels)
    _check_asked(chosen, asked)
    check_there(labels, DATASET, "--labels")
    chosen.check(output, force)
    said = _written(chosen, to, out, output, force, asked)
    plain().print("\n".join([str(output), *said]))


def _check_asked(chosen: Export, asked: _Asked) -> None:
    """Fail where the format has no place for what is asked."""
    check_numbers(asked.shift_m, asked.fps)
    if asked.fps is not None and asked.trajectory is None:
        raise InputError("--fps is the rate of a new drive; give --trajectory NAME|FILE with it")
    for option, given in asked.options.items():
        if given and option not in chosen.takes:
            able = ", ".join(name for name in EXPORTS if option in EXPORTS[name].takes)
            raise InputError(f"--to {chosen.name} takes no --{option}; these do: {able}")


def _written(chosen: Export, to: str, out: Path, output: Path, force: bool, asked: _Asked) -> list[str]:
    """Write it, and say what it holds."""
    from dreamdrive.data.truth_folder import is_world, read_drives
    from dreamdrive.run import stages_of

    pictures = "clip" in chosen.takes
    with Bars(plain()) as bars:
        how: dict[str, Any] = {"replace": force, "progress": partial(bars, to)}
        if asked.blur:
            how["blur"] = blurring()
        if chosen.world is not None and is_world(out):
            _check_world(out, asked)
            named = {"name": out.resolve().name} if "name" in chosen.takes else {}
            function(chosen.world)(read_drives(out), output, **named, **how)
            return [_OF_WORLD] if pictures else []
        scene, stages = open_scene(out), stages_of(out)
        clip, geometry = _kept(stages, scene) if pictures and not asked.changed else (None, None)
        if asked.labels is not None:
            how["labels"] = _labels(out, scene, asked.labels)
        scene = _changed(scene, asked)
        kept: dict[str, object] = {"clip": clip, "geometry": geometry}
        how |= {name: kept[name] for name in chosen.takes & set(kept)}
        if asked.times_s is not None:
            how["times_s"] = asked.times_s
        function(chosen.scene)(scene, output, **how)
    said = [] if chosen.left_out is None else [function(chosen.left_out)(scene, output)]
    return [*said, _of_pictures(clip, stages, asked)] if pictures else said


def _labels(out: Path, scene: "Scene", path: Path) -> "Labels":
    """The labels of the drive that the scene in a folder was made of."""
    from dreamdrive.data.input import dataset_of
    from dreamdrive.edit import EDITS
    from dreamdrive.export import labels_of
    from dreamdrive.run import stages_of

    logs, link = dataset_of(None, path).logs, scene.provenance.log
    if logs is None:
        raise InputError(f"--labels {path} is no data set with labels")
    if link is None:
        raise InputError(f"{out} was made of no drive of a data set; leave --labels out")
    return labels_of(scene, logs.read(path, link.name), edited=(stages_of(out).parent / EDITS).is_file())


def _check_world(out: Path, asked: _Asked) -> None:
    """Fail where something is asked of a drawn street that only scenes have."""
    if asked.changed or asked.times_s is not None or asked.labels is not None:
        raise InputError(
            f"{out} is a drawn street, of which frames and labels are written as they were drawn; "
            "--trajectory, --without, --times and --labels are for scenes of dreamdrive generate"
        )


def _changed(scene: "Scene", asked: _Asked) -> "Scene":
    """The scene as it is asked for; ``InputError`` where it has nothing of the kind."""
    scene = less(scene, asked.without)
    first_s, last_s = float(scene.times_s.min()), float(scene.times_s.max())
    wanted_s = asked.times_s or (first_s,)
    if wanted_s[0] < first_s - _LATE_S or wanted_s[-1] > last_s + _LATE_S:
        raise InputError(
            f"--times: {wanted_s[0]:g} to {wanted_s[-1]:g} s; the scene is known from {first_s:g} to "
            f"{last_s:g} s"
        )
    if asked.trajectory is None:
        return scene
    from dreamdrive.drive import along, drives_of

    (drive,) = drives_of(scene, [asked.trajectory], asked.shift_m, asked.fps)
    return along(scene, drive.path)


def _of_pictures(clip: "Clip | None", stages: Path, asked: _Asked) -> str:
    """What the pictures of a scene are."""
    if asked.trajectory is not None:
        return f"Pictures are rendered from the scene along {asked.trajectory}."
    if asked.without:
        return "Pictures are rendered from the scene, without what was left out."
    if clip is None:
        return f"Pictures are rendered from the scene: {stages} does not hold its frames."
    return "Pictures are the frames that the scene was made of."


def _kept(stages: Path, scene: "Scene") -> "tuple[Clip | None, Geometry | None]":
    """What the run kept of clip and geometry; ``InputError`` where they are not those of the scene."""
    from dreamdrive.run import kept_clip, kept_geometry

    clip = kept_clip(stages, scene)
    return clip, None if clip is None else kept_geometry(stages, scene, clip)
