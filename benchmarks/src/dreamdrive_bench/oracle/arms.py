"""Scenes with truth in place of parts, and how well they show their street."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Bool, UInt8

from dreamdrive.build import Given, build_scene
from dreamdrive.decompose import Actors, Grouping, error_maps, find_actors, group, score
from dreamdrive.files.digest import stage_seed
from dreamdrive.fit import StaticFit, fit_static, initialise
from dreamdrive.geometry import reconstruct
from dreamdrive.options import Options
from dreamdrive.progress import silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.look import Look
from dreamdrive.street_network import look_at, with_looks
from dreamdrive_bench.oracle.truth import true_labels, true_paths, with_true_depth
from dreamdrive_bench.oracle.views import Seen
from dreamdrive_bench.street.case import Case, clip_of, world_of
from dreamdrive_bench.street.measure import frames_of, told_apart

PARTS = ("labels", "tracks", "moving", "standing")
"""What truth can stand in place of: the vote, the paths, the depth of what moves, that of what stands."""
ARMS: tuple[tuple[str, ...], ...] = (
    (),
    ("labels",),
    ("tracks",),
    ("moving",),
    ("standing",),
    ("labels", "tracks"),
    ("labels", "moving"),
    ("tracks", "moving"),
    ("labels", "tracks", "moving"),
    PARTS,
)


@dataclass(frozen=True)
class Begun:
    """A clip with its geometry, and what a fit begins with."""

    clip: Clip
    looks: tuple[Look, ...] | None
    geometry: Geometry
    seeds: Gaussians
    static: StaticFit


@lru_cache(maxsize=1)
def _posed(case: Case, options: Options) -> tuple[Clip, tuple[Look, ...] | None, Geometry]:
    looks = look_at(clip_of(case), options.knowledge)
    clip = with_looks(clip_of(case), looks)
    return clip, looks, reconstruct(clip, options.geometry, seed=stage_seed(0, "geometry"))


@lru_cache(maxsize=1)
def begun(case: Case, options: Options, standing: bool, moving: bool) -> Begun:
    """The case up to its static fit, with the true depth of what stands or moves."""
    clip, looks, geometry = _posed(case, options)
    if standing or moving:
        made = world_of(case.seed)
        geometry = with_true_depth(geometry, clip, made, standing=standing, moving=moving)
    seeds = initialise(clip, geometry, options.seeds)
    seed = stage_seed(0, "static")
    return Begun(
        clip, looks, geometry, seeds, fit_static(clip, geometry, seeds, options.static, seed, silent)
    )


def scene_of(case: Case, options: Options, arm: tuple[str, ...]) -> Scene:
    """The scene with truth in place of the parts that the arm names."""
    made, parts = world_of(case.seed), begun(case, options, "standing" in arm, "moving" in arm)
    labels = true_labels(made, parts.geometry, parts.seeds) if "labels" in arm else _voted(parts, options)
    tracks = _tracked(parts, labels, options, case) if "tracks" in arm else None
    given = Given(parts.geometry, parts.static, labels, tracks, parts.looks)
    return build_scene(clip_of(case), options, given=given).scene


def _voted(parts: Begun, options: Options) -> Grouping:
    shown = parts.static.pictures(parts.clip, parts.geometry)
    maps = error_maps(parts.clip, parts.geometry, shown)
    seed = stage_seed(0, "score")
    scores = score(parts.clip, parts.geometry, parts.seeds, maps, options.score, seed, silent)
    return group(parts.clip, parts.geometry, parts.seeds, scores, options.group, options.seeds.reach_px)


def _tracked(parts: Begun, labels: Grouping, options: Options, case: Case) -> Actors:
    paths = true_paths(world_of(case.seed), parts.geometry, parts.clip, parts.seeds, labels)
    return find_actors(
        parts.clip, parts.geometry, parts.seeds, labels, options.cast, options.seeds.reach_px, known=paths
    )


def likeness(
    shown: UInt8[np.ndarray, "f h w 3"], view: Seen, among: Callable[[str], bool] = lambda group: True
) -> dict[str, Any]:
    """PSNR of each group's pixels over the frames that count.

    Of ``all`` it is the mean over frames, as everywhere; of the others, which some frames hardly show, it is
    that of their mean square.
    """
    wrong = np.square(shown.astype(np.float32) - view.frames).mean(axis=-1) / 255**2
    found: dict[str, Any] = {}
    for name, mask in view.groups.items():
        inside = mask[view.counts]
        share = float(inside.mean()) if inside.size else 0.0
        found[name] = _psnr(wrong[view.counts], inside, name == "all") if among(name) and share else None
        found[f"{name}_share"] = share
    return found


def _psnr(wrong: np.ndarray, inside: Bool[np.ndarray, "f h w"], by_frame: bool) -> float:
    if by_frame:
        return float(np.mean([-10 * np.log10(max(each.mean(), 1e-10)) for each in wrong]))
    return float(-10 * np.log10(max(wrong[inside].mean(), 1e-10)))


def judged(case: Case, options: Options, arm: tuple[str, ...], views: dict[str, Seen]) -> dict[str, Any]:
    """The figures of one arm, view by view, and how well what moves is told apart."""
    scene = scene_of(case, options, arm)
    shown = {name: likeness(frames_of(scene, case.seed, name), view) for name, view in views.items()}
    return {**shown, "apart": told_apart(scene, case.seed)}


def ceiling(views: dict[str, Seen]) -> dict[str, Any]:
    """Those of reading each seen pixel from a training frame."""
    known = ("standing", "moving")
    return {name: likeness(v.ceiling, v, lambda group: group in known) for name, v in views.items()}
