"""The paper's figure: from a clip to a scene by F_MVS, seeds, decomposition and joint fit."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import torch
from jaxtyping import Float, Float16

from dreamdrive.complete import completed
from dreamdrive.data.pictures.picture_file import kept_frame
from dreamdrive.decompose import (
    Actors,
    Grouping,
    error_maps,
    find_actors,
    group,
    outside,
    per_frame_street,
    pixels_of,
    score,
    stands,
    with_between,
    without_sky,
)
from dreamdrive.files.digest import file_digest, stage_seed
from dreamdrive.fit import Parts, StaticFit, Trial, better_depth, fit, fit_static, initialise, trial
from dreamdrive.geometry import BACKENDS, calmed, reconstruct
from dreamdrive.motion import REPRESENTATIONS
from dreamdrive.options import Options
from dreamdrive.progress import Run, Work, call
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.look import Look
from dreamdrive.splat import render_scene
from dreamdrive.stored import check
from dreamdrive.street_network import NO_KNOWLEDGE, look_at, weights_of, with_looks
from dreamdrive.vision.residual import residual_of


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
    tracks: Actors | None = None
    looks: tuple[Look, ...] | None = None


@dataclass(frozen=True)
class Built:
    """A scene, and what it was built of.

    Attributes:
        clip: The frames.
        geometry: Cameras and depth.
        static: The fit as if nothing moved.
        scores: How dynamic each seed is, 0 to 1; None where labels were given or nothing is told apart.
        scene: The scene.
    """

    clip: Clip
    geometry: Geometry
    static: StaticFit
    scores: Float[torch.Tensor, " n"] | None
    scene: Scene


def build_scene(
    clip: Clip, options: Options, *, seed: int = 0, given: Given = Given(), run: Run = call
) -> Built:
    """From the frames of a clip to a scene: F_MVS, seeds, static fit, decomposition and joint fit.

    Args:
        clip: The frames, with features and what is known of their geometry.
        options: Of each stage.
        seed: Of everything random.
        given: Results that are known already.
        run: Wraps each stage: ``call`` computes it, ``run.Stages`` keeps its result on disk.

    Returns:
        The scene, with what it was built of.

    Raises:
        InputError: The clip cannot be used.
    """
    o = options.for_clip(clip)
    seeded = {name: stage_seed(seed, name) for name in ("geometry", "static", "fit")}
    device = torch.device(o.device)
    weights = None if o.knowledge == NO_KNOWLEDGE else file_digest(weights_of(o.knowledge))
    looks = run(
        "look",
        weights,
        lambda work: look_at(clip, o.knowledge, work),
        check=partial(check.looks, clip),
        given=given.looks,
    )
    seen = with_looks(clip, looks)
    geometry = run(
        "geometry",
        [o.geometry, BACKENDS.package(o.geometry.method), o.seeds, o.trial, o.drift, seed],
        lambda work: _as_frames_say(
            seen, reconstruct(seen, o.geometry, seed=seeded["geometry"], work=work), o, seeded["static"]
        ),
        check=partial(check.geometry, seen),
        given=_unasked(given.geometry),
    )
    seeds = run(
        "initialise",
        o.seeds,
        lambda _: initialise(seen, geometry, o.seeds),
        check=partial(check.seeds, seen),
    )
    static = run(
        "static",
        [o.static, o.device, seed],
        lambda work: fit_static(seen, geometry, seeds, o.static, seeded["static"], work, device),
        check=partial(check.static, seeds),
        given=given.static,
    )
    parts, scores = decompose(seen, geometry, seeds, static, o, seed=seed, given=given, run=run)
    scene = run(
        "fit",
        [
            *(o.representation, o.fit, o.cast, o.drift, o.trial, o.motion, o.densify, o.completion),
            *(o.device, given.tracks),
        ],
        lambda work: _completed(
            seen, geometry, _fitted(seen, geometry, parts, static, o, seeded["fit"], work, device), o
        ),
        check=partial(check.scene, seen),
    )
    return Built(clip, geometry, static, scores, scene)


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
    """The joint fit; of a per-frame street also to the frames between, with its sky among its surfaces."""
    o = options
    if parts.static.velocity is None:
        return fit(clip, geometry, parts, static, o.fit, o.motion, o.densify, seed, work, device)
    denser, seen = with_between(clip, without_sky(geometry, o.seeds.far_m))
    steps = replace(o.fit, steps=round(o.drift.steps * o.fit.steps))
    scene = fit(denser, seen, parts, static, steps, o.motion, o.densify, seed, work, device)
    recorded = {"times_s": clip.times_s, "held_out": clip.held_out, "cameras": geometry.cameras}
    return replace(scene, camera=clip.camera if len(clip.rig) > 1 else None, **recorded)


def _completed(clip: Clip, geometry: Geometry, scene: Scene, options: Options) -> Scene:
    """The scene with what stands where no frame looks, with its frames and how far it is off them.

    What the prior made up stands there; and where it did not, a guess from around.
    """
    device, unseen = torch.device(options.device), clip.known.unseen
    if unseen is not None and not scene.moves_per_frame and len(scene.static):
        scene = scene.with_standing(unseen)
    scene = completed(scene, geometry, options.completion, device)
    frames = [
        b"" if held else kept_frame(each) for each, held in zip(clip.frames, clip.held_out, strict=True)
    ]
    return replace(scene, residual=_residual(clip, scene.on(device)), frames=tuple(frames))


def _residual(clip: Clip, scene: Scene) -> Float16[np.ndarray, "f bh bw"]:
    """Of each recorded view."""
    views = zip(scene.cameras, scene.times_s.tolist(), clip.frames, strict=True)
    shown = [
        residual_of(render_scene(scene, camera, t_s, of_rig=scene.of_rig(i)).colour.numpy(), frame)
        for i, (camera, t_s, frame) in enumerate(views)
    ]
    return np.stack(shown)


def decompose(
    clip: Clip,
    geometry: Geometry,
    seeds: Gaussians,
    static: StaticFit,
    options: Options,
    *,
    seed: int = 0,
    given: Given = Given(),
    run: Run = call,
) -> tuple[Parts, Float[torch.Tensor, " n"] | None]:
    """Tell static from moving (eq. 5-10), by scores; the baselines take everything as one or the other."""
    o, fitted, nothing = options, static.gaussians, torch.zeros(0, dtype=torch.int64)
    moves = REPRESENTATIONS[o.representation].moves
    if moves == "none":
        return Parts(fitted, fitted.select(nothing), None, ()), None
    if moves == "all":
        return Parts(seeds.select(nothing), fitted, None, ()), None
    scores = None if given.labels is not None else _scores(clip, geometry, seeds, static, o, seed, run)
    labels = run(
        "group",
        o.group,
        lambda _: group(clip, geometry, seeds, _known(scores), o.group, o.seeds.reach_px),
        check=partial(check.grouping, seeds),
        given=given.labels,
    )
    may_move = _may_move_per_frame(clip, o)
    street = _per_frame_street(clip, geometry, seeds, labels, o, seed) if may_move else None
    if street is not None and geometry.fallback is not None:
        # Where the path is a guess, so are the ways of things on it: all moves as the picture does.
        return Parts(street, seeds.select(nothing), None, ()), scores
    standing = fitted.select(labels.static) if street is None else street
    moving = given.tracks or find_actors(clip, geometry, seeds, labels, o.cast, o.seeds.reach_px)
    return Parts(standing, moving.gaussians, moving.tracks, moving.actors), scores


def _scores(
    clip: Clip, geometry: Geometry, seeds: Gaussians, static: StaticFit, options: Options, seed: int, run: Run
) -> Float[torch.Tensor, " n"]:
    """How dynamic each seed is."""
    o, device = options, torch.device(options.device)

    def compute(work: Work) -> Float[torch.Tensor, " n"]:
        errors = error_maps(clip, geometry, static.on(device).pictures(clip, geometry))
        return score(clip, geometry, seeds, errors, o.score, stage_seed(seed, "score"), work, device)

    return run("score", [o.score, seed], compute, check=partial(check.scores, seeds))


def _known(scores: Float[torch.Tensor, " n"] | None) -> Float[torch.Tensor, " n"]:
    assert scores is not None, "labels are given where scores are not"
    return scores


def _as_frames_say(clip: Clip, geometry: Geometry, options: Options, seed: int) -> Geometry:
    """The geometry with the better of two depths; on a calm path where no street stands on the one found."""
    o, device = options, torch.device(options.device)
    chosen, found = better_depth(clip, geometry, o.seeds, o.trial, seed, partial(_stands, o), device)
    mapped = chosen.fallback is None and clip.known.world_from_camera is None and len(clip.rig) == 1
    calms = mapped and _may_move_per_frame(clip, o)
    if calms and found is None:
        found = trial(clip, chosen, o.seeds, o.trial, seed, device)
    standing = None if found is None else _stands(o, found)
    return calmed(clip, chosen) if calms and standing is False else replace(chosen, stands=standing)


def _unasked(geometry: Geometry | None) -> Geometry | None:
    """The geometry without what was found of it under other options."""
    if geometry is None or geometry.stands is None:
        return geometry
    return replace(geometry, stands=None)


def _may_move_per_frame(clip: Clip, options: Options) -> bool:
    """Not where frames were drawn from their depth: they show a street that stands, whatever the fit says."""
    return options.drift.allowed and not clip.known.drawn


def _stands(options: Options, found: Trial) -> bool:
    """Whether a street that stands predicts withheld frames."""
    return stands(found.clip, found.frames, found.errors, found.judged, options.drift)


def _per_frame_street(
    clip: Clip, geometry: Geometry, seeds: Gaussians, labels: Grouping, options: Options, seed: int
) -> Gaussians | None:
    """A per-frame street, beside what moves; None where one that stands predicts the frames."""
    standing = geometry.stands
    if standing is None:  # not asked, or about another path
        device, seed = torch.device(options.device), stage_seed(seed, "static")
        found = trial(clip, geometry, options.seeds, options.trial, seed, device)
        standing = found is None or _stands(options, found)
    if standing:
        return None
    filmed = without_sky(geometry, options.seeds.far_m)
    dense = replace(options.seeds, moving_stride_px=options.drift.spacing_px, sky_fringe_px=0)
    every = initialise(clip, replace(filmed, moving=np.ones_like(geometry.moving)), dense)
    if geometry.fallback is None:
        moving = np.flatnonzero(labels.dynamic.numpy())
        taken = pixels_of(geometry, seeds, moving, options.seeds.moving_stride_px // 2)
        every = every.select(outside(geometry, every, taken))
    return per_frame_street(clip, filmed, every, options.drift)
