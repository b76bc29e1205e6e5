"""From an input to a folder: read, build, publish."""

from collections.abc import Callable
from pathlib import Path

from dreamdrive.build import build_scene
from dreamdrive.compute.device import computing_on
from dreamdrive.files.output import check_place
from dreamdrive.names import QualityName
from dreamdrive.options import Options, chosen_options
from dreamdrive.progress import StageProgress
from dreamdrive.run import REPORT, Outcome, only_run, open_workspace, read_outcome, request_of, start
from dreamdrive.scene.control import Control
from dreamdrive.splat import why_unusable
from dreamdrive.stored import check


def generate(
    control: Control | Path | str,
    out: Path | str,
    *,
    prior: str | None = None,
    geometry_files: Path | None = None,
    weights: str | Path | None = None,
    geometry_weights: str | Path | None = None,
    options: Options | QualityName | None = None,
    quality: QualityName | None = None,
    camera_height_m: float | None = None,
    recompute_from: str | None = None,
    force: bool = False,
    progress: StageProgress = lambda stage, done, total: None,
    say: Callable[[str], None] = lambda sentence: None,
) -> Outcome:
    """Make a scene, its videos and a report in the folder ``out``.

    An interrupted run goes on from its last finished stage when called again; the scene is byte-identical to
    that of a run in one go.

    Args:
        control: The input and how to read it; its seed is that of everything random. Or
            the path of the input alone.
        out: The output folder, see ``run.workspace``.
        prior: Name in ``prior.PRIORS``; without it the input decides, see ``prior.auto_prior``.
        geometry_files: File or folder with cameras, poses and depth to use, see ``geometry.backends.files``.
        weights: The network, of the prior if it has one, else of the geometry method: a file or folder, or a
            name, see ``models.find_weights``.
        geometry_weights: The network of the geometry method, where the prior has one too.
        options: How the scene is built, or a name in ``options.QUALITIES``; ``"standard"`` without it.
        quality: The same name; one of both.
        camera_height_m: Height of the camera above the road, in place of that of the options.
        recompute_from: Compute this stage and all later ones again.
        force: Replace a result of another input or other options.
        progress: Told of every step of every stage.
        say: Told what somebody who waits wants to know, a sentence each: what the run will cost, and where a
            first picture lies.

    Returns:
        How the run ended, also where ``out`` already held the finished result.

    Raises:
        InputError: The input, an option or ``out`` cannot be used, or memory cannot hold the clip.
    """
    control, out = control if isinstance(control, Control) else Control(Path(control)), Path(out)
    request = request_of(
        control,
        prior=prior,
        geometry_files=geometry_files,
        weights=weights,
        geometry_weights=geometry_weights,
        options=chosen_options(options, quality, camera_height_m),
    )
    check_place(out, control.path)
    with computing_on(request.options.device, why_unusable), only_run(out):
        again = recompute_from is not None
        workspace = open_workspace(out, request.document, force=force, recompute=again)
        if workspace is None:
            return read_outcome(out / REPORT, already_finished=True)
        made = start(workspace, request, recompute_from, progress, say)
        clip = made("prior", request.reading, request.read, check=check.clip)
        made.then["geometry"] = lambda geometry: made.show_first(clip, geometry)
        return made.publish(build_scene(clip, request.options, seed=control.seed, run=made))
