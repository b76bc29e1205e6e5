"""The paper's pipeline: prior, geometry, Gaussians, decomposition, joint fit; each stage kept on disk."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8

from dreamdrive.data import read_clip
from dreamdrive.data.rig import is_rig
from dreamdrive.decompose import cast, error_maps, group, score
from dreamdrive.device import computing_on
from dreamdrive.errors import InputError
from dreamdrive.fit import Parts, StaticFit, fit, fit_static, initialise
from dreamdrive.geometry import backend_of, reconstruct
from dreamdrive.geometry.files import EXPECTED, attach, bent_model, companions
from dreamdrive.geometry.picture import draw_geometry
from dreamdrive.held_out import score_baselines, score_scene
from dreamdrive.hub import find_weights
from dreamdrive.memory import available_cores, free_bytes
from dreamdrive.motion import choose_representation
from dreamdrive.options import QUALITIES, Quality, QualityName
from dreamdrive.pictures import Scored, lens_of, write_held_out, write_png, write_videos
from dreamdrive.prior import choose_prior, prior_of
from dreamdrive.report import describe
from dreamdrive.run.agreement import (
    check_clip,
    check_geometry,
    check_grouping,
    check_scene,
    check_scores,
    check_seeds,
    check_static,
)
from dreamdrive.run.cost import announcement, check_memory, plan
from dreamdrive.run.lock import only_run
from dreamdrive.run.outcome import Outcome, outcome_of, read_outcome
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.files import inside
from dreamdrive.scene.folder import load_scene, save_scene
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.splat.cuda import why_unusable
from dreamdrive.stages import (
    STAGES,
    Progress,
    StageProgress,
    Stages,
    Storage,
    digest,
    file_digest,
    stage_seed,
)
from dreamdrive.workspace import REPORT, Workspace, check_writable, open_workspace

Say = Callable[[str], None]
"""Called with a sentence for somebody who waits."""

FIRST_PICTURE = "first.png"
"""In the folder of the stages: what the geometry shows, before anything is fitted."""

_OF_GEOMETRY = ("geometry-files", "weights")


def generate(
    control: Control,
    out: Path,
    *,
    prior: str | None = None,
    geometry_method: str = "classical",
    geometry_files: Path | None = None,
    weights: str | Path | None = None,
    geometry_weights: str | Path | None = None,
    refine_poses: bool = False,
    quality: QualityName = "standard",
    representation: str = "hybrid",
    device: str = "cpu",
    camera_height_m: float | None = None,
    recompute_from: str | None = None,
    force: bool = False,
    progress: StageProgress = lambda stage, done, total: None,
    say: Say = lambda sentence: None,
) -> Outcome:
    """Make a scene, its videos and a report in the folder ``out``.

    An interrupted run goes on from its last finished stage when called again; the scene is byte-identical to
    that of a run in one go.

    Args:
        control: The input and how to read it; its seed is that of everything random.
        out: The output folder, see ``workspace``.
        prior: Name in ``prior.PRIORS``; without it the input decides, see ``prior.prior_of``.
        geometry_method: How cameras and depth are found.
        geometry_files: File or folder with cameras, poses and depth to use, see ``geometry.files``.
        weights: The network, of the prior if it has one, else of the geometry method: a file or folder, or a
            name, see ``hub.find_weights``.
        geometry_weights: The network of the geometry method, where the prior has one too.
        refine_poses: Whether given poses tell only how long the path is, see ``geometry.refine``.
        quality: Name in ``options.QUALITIES``.
        representation: Name in ``motion.REPRESENTATIONS``.
        device: "cpu" or "cuda": where networks and the fits are computed.
        camera_height_m: Height of the camera above the road, which fixes the metric scale where nothing
            better does; None assumes 1.5 m.
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
    prior = prior or prior_of(control.path, weights is not None)
    control, network = _with_networks(control, prior, weights, geometry_weights)
    choose_prior(prior).check(control)
    backend_of(geometry_method, network)
    choose_representation(representation)
    if camera_height_m is not None and not 0 < camera_height_m < float("inf"):
        raise InputError(f"--camera-height {camera_height_m:g}: expected metres above the road, such as 1.5")
    if control.path is not None and out.resolve() == control.path.resolve():
        raise InputError(f"{out} is the input itself; choose another output folder")
    control = _with_lens(control, geometry_files)
    options = {
        "prior": prior,
        "geometry": geometry_method,
        "quality": quality,
        "representation": representation,
        "device": device,
        "camera_height_m": camera_height_m,
        "refine_poses": refine_poses,
        **_reading(control),
    }
    request = {
        "digests": _digests(control, geometry_files, network),
        "options": options,
        "seed": control.seed,
    }
    recompute = recompute_from is not None
    check_writable(out)
    with computing_on(device, why_unusable), only_run(out):
        workspace = open_workspace(out, request, force=force, recompute=recompute)
        if workspace is None:
            return read_outcome(inside(out, REPORT), already_finished=True)
        # What a run takes was measured on CPUs.
        _announce(control, prior, quality, representation, say if device == "cpu" else lambda sentence: None)
        stages = Stages(workspace.stages, recompute_from, progress, workspace.claim)
        made = _make(stages, control, geometry_files, network, request, say)
        return outcome_of(_publish(workspace, stages, control, made), REPORT, already_finished=False)


def _announce(control: Control, prior: str, quality: QualityName, representation: str, say: Say) -> None:
    """Say what the run will cost, where that is known before the frames are read.

    Raises:
        InputError: Memory cannot hold it.
    """
    planned = plan(control, prior)
    if planned is None:
        return
    check_memory(planned, free_bytes())
    for sentence in announcement(planned, quality, representation, available_cores()):
        say(sentence)


@dataclass(frozen=True)
class _Made:
    """All that a run of the stages leaves."""

    clip: Clip
    geometry: Geometry
    scene: Scene
    scored: Scored | None


def _make(
    stages: Stages,
    control: Control,
    geometry_files: Path | None,
    weights: Path | None,
    request: dict[str, Any],
    say: Say,
) -> _Made:
    """The stages in their order, each with the results it depends on and the options that change it."""
    chosen, height_m = request["options"], request["options"]["camera_height_m"]
    quality = QUALITIES[chosen["quality"]]
    seed = {name: stage_seed(control.seed, name) for name in STAGES}
    device = torch.device(chosen["device"])

    of_geometry = [request["digests"].get(name) for name in _OF_GEOMETRY]
    files = {name: value for name, value in request["digests"].items() if name not in _OF_GEOMETRY}
    reading = [chosen["prior"], _reading(control), files, control.seed]
    clip = stages.run("prior", (), reading, partial(choose_prior(chosen["prior"]), control), check=check_clip)

    method = chosen["geometry"]
    geometry = stages.run(
        "geometry",
        ("prior",),
        [method, height_m, chosen["refine_poses"], *of_geometry, seed["geometry"]],
        lambda tell: _reconstructed(
            clip if geometry_files is None else attach(clip, geometry_files, control.path),
            clip,
            camera_height_m=height_m,
            seed=seed["geometry"],
            method=method,
            weights=weights,
            refine_poses=chosen["refine_poses"],
            progress=tell,
        ),
        check=partial(check_geometry, clip),
    )
    if not stages.records["geometry"].cached:
        picture = inside(stages.folder, FIRST_PICTURE)
        write_png(picture, draw_geometry(clip, geometry))
        say(f"A first picture is there, of the path, distances and what moves: {picture}")
    seeds = stages.run(
        "initialise",
        ("prior", "geometry"),
        quality.seeds,
        lambda _: initialise(clip, _seen(clip, geometry), quality.seeds),
        check=partial(check_seeds, clip),
    )
    static = stages.run(
        "static",
        ("initialise",),
        [quality.static, chosen["device"], seed["static"]],
        lambda tell: fit_static(clip, geometry, seeds, quality.static, seed["static"], tell, device),
        check=partial(check_static, seeds),
    )
    mode = chosen["representation"]
    scored, parts = _decompose(stages, clip, geometry, seeds, static, quality, mode, seed["score"])
    of_fit = [mode, quality.fit, quality.cast, quality.motion(mode), quality.densify]
    scene = stages.run(
        "fit",
        ("static", "group") if scored else ("static",),
        [*of_fit, chosen["device"], seed["fit"]],
        lambda tell: _fitted(
            control, clip, geometry, parts, static, quality, mode, seed["fit"], tell, device
        ),
        Storage[Scene](lambda path, made: save_scene(made, path, replace=True), load_scene),
        check=partial(check_scene, clip),
    )
    return _Made(clip, geometry, scene, scored)


def _reconstructed(attached: Clip, clip: Clip, **how: Any) -> Geometry:
    """F_MVS (eq. 4), on top of what the user's files say; what was noticed about these is kept."""
    geometry = reconstruct(attached, **how)
    noticed = attached.provenance.get("notes", [])[len(clip.provenance.get("notes", [])) :]
    return replace(geometry, detected=(*noticed, *geometry.detected))


def _with_networks(
    control: Control, prior: str, weights: str | Path | None, geometry_weights: str | Path | None
) -> tuple[Control, Path | None]:
    """The control with the prior's network, and the network of the geometry."""
    if choose_prior(prior).weights is None:
        if weights is not None and geometry_weights is not None:
            raise InputError(
                "--weights and --geometry-weights are given, but the prior "
                f"{prior} has no network; leave one out"
            )
        weights, geometry_weights = None, geometry_weights or weights
    made = control if weights is None else replace(control, weights=find_weights(weights))
    return made, None if geometry_weights is None else find_weights(geometry_weights)


def _with_lens(control: Control, geometry_files: Path | None) -> Control:
    """A lens in the geometry files has to be taken out of the frames when they are read."""
    if geometry_files is None or control.intrinsics is not None or control.hfov_deg is not None:
        return control
    return replace(control, intrinsics=bent_model(geometry_files))


def _seen(clip: Clip, geometry: Geometry) -> Geometry:
    """The geometry itself, if there is anything in it to make Gaussians from."""
    solid = clip.valid & (geometry.depth_m > 0) & ~geometry.sky & (geometry.fixed_regions[clip.camera] == 0)
    if not solid[~clip.held_out].any():
        raise InputError(
            "no frame shows anything solid: all of it is sky, fixed to the camera or without a picture; "
            "choose other --frames"
        )
    return geometry


def _decompose(
    stages: Stages,
    clip: Clip,
    geometry: Geometry,
    seeds: Gaussians,
    static: StaticFit,
    settings: Quality,
    representation: str,
    seed: int,
) -> tuple[Scored | None, Parts]:
    """Tell static from moving (eq. 5-10); the baselines take everything as one or the other."""
    nothing = torch.zeros(0, dtype=torch.int64)
    moves = choose_representation(representation).moves
    if moves == "none":
        return None, Parts(static.gaussians, static.gaussians.select(nothing), None, ())
    if moves == "all":
        return None, Parts(seeds.select(nothing), static.gaussians, None, ())
    scores = stages.run(
        "score",
        ("static",),
        [settings.score, seed],
        lambda tell: score(
            clip,
            geometry,
            seeds,
            error_maps(clip, geometry, static.gaussians, static.sky, static.exposure, settings.score.error),
            settings.score,
            seed,
            tell,
        ),
        check=partial(check_scores, seeds),
    )
    grouping = stages.run(
        "group",
        ("initialise", "score"),
        settings.group,
        lambda _: group(clip, geometry, seeds, scores, settings.group),
        check=partial(check_grouping, seeds),
    )
    moving = cast(clip, geometry, seeds, grouping, settings.cast)
    parts = Parts(static.gaussians.select(grouping.static), moving.gaussians, moving.tracks, moving.actors)
    return Scored(static.gaussians, scores, settings.group.threshold), parts


def _fitted(
    control: Control,
    clip: Clip,
    geometry: Geometry,
    parts: Parts,
    start: StaticFit,
    quality: Quality,
    representation: str,
    seed: int,
    progress: Progress,
    device: torch.device,
) -> Scene:
    """The joint fit (eq. 11-14), with what a scene remembers of its making."""
    motion = quality.motion(representation)
    scene = fit(clip, geometry, parts, start, quality.fit, motion, quality.densify, seed, progress, device)
    about = {
        "input": None if control.path is None else control.path.name,
        "source_index": clip.source_index.tolist(),
        "lens": clip.provenance.get("lens"),
        "up": None if geometry.ground is None else geometry.ground.normal_world.tolist(),
        "scale": geometry.scale.source,
    }
    return replace(scene, provenance=about)


def _publish(workspace: Workspace, stages: Stages, control: Control, made: _Made) -> dict[str, Any]:
    """Put scene, videos, withheld frames and report into the output folder, all at once; the report."""
    staging, clip, scene = workspace.fresh_staging(), made.clip, made.scene
    chosen = workspace.request["options"]

    def show(progress: Progress) -> None:
        save_scene(scene, staging / "scene")
        write_videos(staging / "video", scene, _recorded(control, clip, scene), made.scored, progress)
        write_held_out(staging / "held_out", scene, clip.source_index.tolist())
        write_png(staging / "report.png", draw_geometry(clip, made.geometry))

    stages.measure("videos", show)
    report = describe(
        clip,
        made.geometry,
        scene,
        {**workspace.request, "input": None if control.path is None else str(control.path)},
        stages.records,
        QUALITIES[chosen["quality"]].steps(chosen["representation"]),
        score_scene(clip, made.geometry, scene),
        score_baselines(clip, made.geometry),
    )
    workspace.publish(report)
    return report


def _reading(control: Control) -> dict[str, Any]:
    """The options of reading that are no files."""
    files = ("path", "intrinsics", "poses", "trajectory", "weights", "features")
    return {k: v for k, v in asdict(control).items() if k not in (*files, "seed")}


def _digests(control: Control, geometry_files: Path | None, weights: Path | None) -> dict[str, str]:
    """Digests of the given files: they count by their content, not by their place."""
    given = {
        "input": (control.path, "a video or a folder of images"),
        "intrinsics": (control.intrinsics, "a calibration file"),
        "poses": (control.poses, "a file with poses"),
        "trajectory": (control.trajectory, "a file with poses"),
        "features": (control.features, "a .safetensors file, see docs/replay.md"),
        "prior-weights": (control.weights, "a file of weights or its folder"),
        "geometry-files": (geometry_files, EXPECTED),
        "weights": (weights, "a file of weights or its folder"),
    }
    digests: dict[str, str] = {}
    for name, (path, expected) in given.items():
        if path is None:
            continue
        if not path.exists():
            flag = "" if name == "input" else f"--{name} "
            raise InputError(f"{flag}{path} does not exist; expected {expected}")
        deep = name in ("geometry-files", "prior-weights") or is_rig(path)
        digests[name] = file_digest(_pictures(path) if name == "input" else path, deep=deep)
        beside = companions(path) if name == "geometry-files" else []
        if beside:
            digests[name] = digest([digests[name], *(file_digest(each, deep=True) for each in beside)])
    return digests


def _pictures(path: Path) -> Path:
    """What counts of an input: of a folder with ``frames`` in it, as of ``data.source``, these alone."""
    frames = path / "frames"
    return frames if frames.is_dir() and not is_rig(path) else path


def _recorded(control: Control, clip: Clip, scene: Scene) -> UInt8[np.ndarray, "f h w 3"]:
    """The frames in the source's distortion, at the clip's size."""
    if lens_of(scene) is None or control.path is None:
        return clip.frames[scene.front]
    return read_clip(control.path, frames=control.frames, fps=control.fps, size=clip.size).frames
