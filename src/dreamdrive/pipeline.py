"""The paper's pipeline: prior, geometry, Gaussians, decomposition, joint fit."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import torch

from dreamdrive.choices import BACKENDS, QualityName
from dreamdrive.decompose import (
    Cast,
    Grouping,
    cast,
    drifting,
    error_maps,
    group,
    outside,
    pixels_of,
    score,
    stands,
    with_between,
    without_sky,
)
from dreamdrive.device import computing_on
from dreamdrive.fit import Parts, StaticFit, Trial, better_depth, fit, fit_static, initialise, trial
from dreamdrive.geometry import calmed, reconstruct
from dreamdrive.knowledge import NO_KNOWLEDGE, look_at, weights_of, with_looks
from dreamdrive.motion import REPRESENTATIONS
from dreamdrive.options import Options
from dreamdrive.progress import StageProgress, Work
from dreamdrive.run import (
    REPORT,
    Outcome,
    Run,
    call,
    check,
    check_place,
    file_digest,
    only_run,
    open_workspace,
    read_outcome,
    request_of,
    stage_seed,
    start,
)
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.look import Look
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import why_unusable


@dataclass(frozen=True)
class Given:
    """What is known of a clip already, in place of what its stage would find; each may be absent.

    Attributes:
        geometry: Cameras and depth.
        static: The fit as if nothing moved, of the seeds in their order.
        labels: Which seeds move, and with which others.
        tracks: What moves, in canonical places, and how it moves.
        looks: What the street network sees, a look for each camera of the rig.
    """

    geometry: Geometry | None = None
    static: StaticFit | None = None
    labels: Grouping | None = None
    tracks: Cast | None = None
    looks: tuple[Look, ...] | None = None


def generate(
    control: Control,
    out: Path,
    *,
    prior: str | None = None,
    geometry_files: Path | None = None,
    weights: str | Path | None = None,
    geometry_weights: str | Path | None = None,
    options: Options | QualityName = "standard",
    recompute_from: str | None = None,
    force: bool = False,
    progress: StageProgress = lambda stage, done, total: None,
    say: Callable[[str], None] = lambda sentence: None,
) -> Outcome:
    """Make a scene, its videos and a report in the folder ``out``.

    An interrupted run goes on from its last finished stage when called again; the scene is byte-identical to
    that of a run in one go.

    Args:
        control: The input and how to read it; its seed is that of everything random.
        out: The output folder, see ``run.workspace``.
        prior: Name in ``prior.PRIORS``; without it the input decides, see ``prior.auto_prior``.
        geometry_files: File or folder with cameras, poses and depth to use, see ``geometry.backends.files``.
        weights: The network, of the prior if it has one, else of the geometry method: a file or folder, or a
            name, see ``models.find_weights``.
        geometry_weights: The network of the geometry method, where the prior has one too.
        options: How the scene is built, or a name in ``options.QUALITIES``.
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
    request = request_of(
        control,
        prior=prior,
        geometry_files=geometry_files,
        weights=weights,
        geometry_weights=geometry_weights,
        options=options,
    )
    check_place(out, control.path)
    with computing_on(request.options.device, why_unusable), only_run(out):
        again = recompute_from is not None
        workspace = open_workspace(out, request.document, force=force, recompute=again)
        if workspace is None:
            return read_outcome(out / REPORT, already_finished=True)
        made = start(workspace, request, recompute_from, progress, say)
        clip = made("prior", request.reading, request.read, check=check.clip)
        return made.publish(build_scene(clip, request.options, run=made))


def build_scene(clip: Clip, options: Options, *, given: Given = Given(), run: Run = call) -> Scene:
    """From the frames of a clip to a scene: F_MVS, seeds, static fit, decomposition and joint fit.

    Args:
        clip: The frames, with features and what is known of their geometry.
        options: Of each stage.
        given: Results that are known already.
        run: Wraps each stage: ``call`` computes it, ``run.Stages`` keeps its result on disk.

    Raises:
        InputError: The clip cannot be used.
    """
    o = options.for_clip(clip)
    seed = {name: stage_seed(o.seed, name) for name in ("geometry", "static", "fit")}
    device = torch.device(o.device)
    weights = None if o.knowledge == NO_KNOWLEDGE else file_digest(weights_of(o.knowledge))
    looks = run(
        "look",
        weights,
        lambda work: look_at(clip, o.knowledge, work),
        check=partial(check.looks, clip),
        given=given.looks,
    )
    clip = with_looks(clip, looks)
    geometry = run(
        "geometry",
        [o.geometry, BACKENDS.package(o.geometry.method), o.seeds, o.trial, o.drift, o.seed],
        lambda work: _as_frames_say(
            clip, reconstruct(clip, o.geometry, seed=seed["geometry"], work=work), o, seed["static"]
        ),
        check=partial(check.geometry, clip),
        given=given.geometry,
    )
    seeds = run(
        "initialise",
        o.seeds,
        lambda _: initialise(clip, geometry, o.seeds),
        check=partial(check.seeds, clip),
    )
    static = run(
        "static",
        [o.static, o.device, o.seed],
        lambda work: fit_static(clip, geometry, seeds, o.static, seed["static"], work, device),
        check=partial(check.static, seeds),
        given=given.static,
    )
    parts = decompose(clip, geometry, seeds, static, o, given=given, run=run)
    return run(
        "fit",
        [o.representation, o.fit, o.cast, o.drift, o.trial, o.motion, o.densify, o.device, given.tracks],
        lambda work: _completed(
            clip,
            _fitted(clip, geometry, parts, static, o, seed["fit"], work, device),
        ),
        check=partial(check.scene, clip),
    )


def _fitted(
    clip: Clip,
    geometry: Geometry,
    parts: Parts,
    static: StaticFit,
    options: Options,
    seed: int,
    work: Work,
    device: torch.device,
) -> Scene:
    """The joint fit; of a street that drifts also to the frames between, with its sky among its surfaces."""
    o = options
    if parts.static.velocity is None:
        return fit(clip, geometry, parts, static, o.fit, o.motion, o.densify, seed, work, device)
    denser, seen = with_between(clip, without_sky(geometry, o.seeds.far_m))
    steps = replace(o.fit, steps=round(o.drift.steps * o.fit.steps))
    scene = fit(denser, seen, parts, static, steps, o.motion, o.densify, seed, work, device)
    recorded = {"times_s": clip.times_s, "held_out": clip.held_out, "cameras": geometry.cameras}
    return replace(scene, camera=clip.camera if len(clip.rig) > 1 else None, **recorded)


def _completed(clip: Clip, scene: Scene) -> Scene:
    """The scene with what the prior knows to stand where no frame looks."""
    if clip.known.unseen is None or scene.drifts or not len(scene.static):
        return scene
    return scene.with_standing(clip.known.unseen)


def decompose(
    clip: Clip,
    geometry: Geometry,
    seeds: Gaussians,
    static: StaticFit,
    options: Options,
    *,
    given: Given = Given(),
    run: Run = call,
) -> Parts:
    """Tell static from moving (eq. 5-10); the baselines take everything as one or the other."""
    o, fitted, nothing = options, static.gaussians, torch.zeros(0, dtype=torch.int64)
    moves = REPRESENTATIONS[o.representation].moves
    if moves == "none":
        return Parts(fitted, fitted.select(nothing), None, ())
    if moves == "all":
        return Parts(seeds.select(nothing), fitted, None, ())
    errors = cache(partial(error_maps, clip, geometry, fitted, static.sky, static.exposure))
    labels = given.labels
    if labels is None:
        scores = run(
            "score",
            [o.score, o.seed],
            lambda work: score(
                clip,
                geometry,
                seeds,
                errors(),
                o.score,
                stage_seed(o.seed, "score"),
                work,
            ),
            check=partial(check.scores, seeds),
        )
        labels = run(
            "group",
            o.group,
            lambda _: group(clip, geometry, seeds, scores, o.group, o.seeds.reach_px),
            check=partial(check.grouping, seeds),
        )
    else:
        run("group", o.group, lambda _: labels, given=labels)
    street = _drifting(clip, geometry, seeds, labels, o) if _may_drift(clip, o) else None
    if street is not None and geometry.fallback is not None:
        # Where the path is a guess, so are the ways of things on it: all moves as the picture does.
        return Parts(street, seeds.select(nothing), None, ())
    standing = fitted.select(labels.static) if street is None else street
    moving = given.tracks or cast(clip, geometry, seeds, labels, o.cast, o.seeds.reach_px)
    return Parts(standing, moving.gaussians, moving.tracks, moving.actors)


def _as_frames_say(clip: Clip, geometry: Geometry, options: Options, seed: int) -> Geometry:
    """The geometry with the better of two depths; on a calm path where no street stands on the one found."""
    o = options
    chosen, found = better_depth(clip, geometry, o.seeds, o.trial, seed, partial(_stands, o))
    mapped = chosen.fallback is None and clip.known.world_from_camera is None and len(clip.rig) == 1
    if not mapped or not _may_drift(clip, o):
        return chosen
    found = found or trial(clip, chosen, o.seeds, o.trial, seed)
    return chosen if found is None or _stands(o, found) else calmed(clip, chosen)


def _may_drift(clip: Clip, options: Options) -> bool:
    """Not where frames were drawn from their depth: they show a street that stands, whatever the fit says."""
    return options.drift.allowed and not (clip.known.generated and clip.known.depth_m is not None)


def _stands(options: Options, found: Trial) -> bool:
    """Whether a street that stands predicts withheld frames."""
    return stands(found.clip, found.frames, found.errors, found.judged, options.drift)


def _drifting(
    clip: Clip, geometry: Geometry, seeds: Gaussians, labels: Grouping, options: Options
) -> Gaussians | None:
    """A street that drifts, beside what moves; None where one that stands predicts the frames."""
    found = trial(clip, geometry, options.seeds, options.trial, stage_seed(options.seed, "static"))
    if found is None or _stands(options, found):
        return None
    filmed = without_sky(geometry, options.seeds.far_m)
    dense = replace(options.seeds, moving_stride_px=options.drift.spacing_px, sky_fringe_px=0)
    every = initialise(clip, replace(filmed, moving=np.ones_like(geometry.moving)), dense)
    if geometry.fallback is None:
        moving = np.flatnonzero(labels.dynamic.numpy())
        taken = pixels_of(geometry, seeds, moving, options.seeds.moving_stride_px // 2)
        every = every.select(outside(geometry, every, taken))
    return drifting(clip, filmed, every, options.drift)
