"""``report.json``: what was made, from what, how well, and what went wrong on the way."""

import math
import platform
from dataclasses import asdict
from importlib import metadata
from typing import Any, cast

import numpy as np

from dreamdrive import __version__
from dreamdrive.data.table import DATASETS
from dreamdrive.geometry import BACKENDS
from dreamdrive.metrics.paths import compare_paths
from dreamdrive.metrics.retrieval import Retrieval
from dreamdrive.motion import REPRESENTATIONS
from dreamdrive.prior import PRIORS
from dreamdrive.run.program import program_digest
from dreamdrive.run.report.facts import Facts, facts_of
from dreamdrive.run.report.held_out import Likeness
from dreamdrive.run.report.in_motion import traffic_of
from dreamdrive.run.report.judge import limits_of, remarks_of, rough_because
from dreamdrive.run.report.shift import Shift
from dreamdrive.run.stages import StageRecord
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene

PACKAGES = ("torch", "numpy", "scipy", "opencv-python-headless", "pycolmap", "av", "safetensors")
"""Whose versions a result may depend on."""
_AS_ASKED = "the poses are those asked for: the frames are too different from one another to look for others"


def describe(
    clip: Clip,
    geometry: Geometry,
    scene: Scene,
    request: dict[str, Any],
    records: dict[str, StageRecord],
    steps: dict[str, int],
    held_out: dict[int, Likeness],
    baselines: dict[str, dict[int, Likeness]],
    in_motion: Retrieval | None = None,
    shift: Shift | None = None,
    whole_s: float | None = None,
) -> dict[str, Any]:
    """The report as JSON values; a number that is not finite becomes null.

    ``records`` tell what each stage took, ``whole_s`` what all of it did.
    Likeness is that of held-out frames, by index in the clip; baselines are predictions that need no scene.
    ``in_motion`` compares what moves with what the prior set in motion, ``shift`` is the drive beside.
    """
    options = request["options"]
    facts = facts_about(clip, geometry, scene, options, held_out, baselines, in_motion)
    outside = PRIORS.package(options["prior"]) | BACKENDS.package(options["geometry"])
    outside |= DATASETS.package(options["dataset"])
    report = {
        "version": __version__,
        "program": program_digest(),
        "versions": {"python": platform.python_version(), **package_versions(), **outside},
        "input": request["input"],
        "prior": request.get("prior"),
        "options": options,
        "seed": request["seed"],
        "stages": {name: asdict(record) for name, record in records.items()},
        "seconds": None if whole_s is None else round(whole_s, 2),
        "steps": steps,
        "frames": {"count": len(clip), "size": list(clip.size), "source_index": clip.source_index.tolist()},
        "gaussians": {"static": len(scene.static), "dynamic": len(scene.dynamic)},
        "actors": [_of_actor(actor) for actor in scene.actors],
        "set_in_motion": None if in_motion is None else asdict(in_motion),
        "scale": {**asdict(geometry.scale), "disagreement": geometry.scale.disagreement},
        "focal": asdict(geometry.focal),
        "requested": against_request(clip, geometry),
        "detected": list(geometry.detected),
        "fallback": geometry.fallback,
        "rough": list(rough_because(facts)),
        "limits": [*limits_of(facts), *([] if shift is None else [shift.words])],
        "shift_m": None if shift is None else shift.right_m,
        "notes": [*clip.provenance.get("notes", []), *remarks_of(scene)],
        "features": sorted(clip.features),
        "geometry": geometry.details,
        "held_out": _by_source_index(clip, held_out),
        "held_out_mean": _mean(held_out),
        "baselines": {
            name: {"frames": _by_source_index(clip, one), "mean": _mean(one)}
            for name, one in baselines.items()
        },
    }
    return cast(dict[str, Any], _finite(report))


def facts_about(
    clip: Clip,
    geometry: Geometry,
    scene: Scene,
    options: dict[str, Any],
    held_out: dict[int, Likeness],
    baselines: dict[str, dict[int, Likeness]],
    in_motion: Retrieval | None,
) -> Facts:
    """What the judgement of a result rests on; arguments as of ``describe``, options those of its request."""
    return facts_of(
        clip,
        geometry,
        options["quality"],
        held_out,
        baselines.get("flow_interpolation", {}),
        none_stands=REPRESENTATIONS[options["representation"]].moves == "scored" and not len(scene.static),
        moves_per_frame=scene.moves_per_frame,
        traffic=traffic_of(clip, scene, in_motion),
    )


def _of_actor(actor: Actor) -> dict[str, Any]:
    return {
        "id": actor.id,
        "name": actor.name,
        "kind": actor.kind,
        "gaussians": actor.count,
        "first_s": actor.track.first_s,
        "last_s": actor.track.last_s,
        "path_m": actor.track.length_m,
        "size_m": None if actor.box is None else actor.box.size_m.tolist(),
        "speed_m_s": float(np.median(actor.track.speed_m_s)),
        "spread_m": None if actor.spread_m is None else float(np.median(actor.spread_m)),
        "completed": actor.completed,
    }


def against_request(clip: Clip, geometry: Geometry) -> dict[str, Any] | None:
    """How far the path in the frames is from the one they were asked for; None where none was asked for.

    Where the path was not looked for in the frames but taken as asked for, ``error`` is None and ``reason``
    says so.
    """
    if clip.requested is None:
        return None
    if clip.known.generated and clip.known.world_from_camera is not None:
        return {"length_m": clip.requested.length_m, "error": None, "reason": _AS_ASKED}
    lead = clip.of_camera(int(clip.camera[0]))
    found = np.stack([geometry.cameras[i].world_from_camera for i in lead])
    error = compare_paths(found, clip.requested.at(clip.times_s[lead]))
    length_m = clip.requested.length_m
    return {"length_m": length_m, "error": None if error is None else asdict(error)}


def package_versions() -> dict[str, str | None]:
    """Installed versions of ``PACKAGES``; None where one is missing."""
    versions: dict[str, str | None] = {}
    for name in PACKAGES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = None
    return versions


def _by_source_index(clip: Clip, scores: dict[int, Likeness]) -> dict[str, dict[str, float]]:
    """Likeness by index in the source; of the cameras after the first with their number in the rig."""
    named: dict[str, dict[str, float]] = {}
    for i, one in scores.items():
        camera = int(clip.camera[i])
        named[f"{int(clip.source_index[i])}{f'_camera{camera}' if camera else ''}"] = asdict(one)
    return named


def _mean(scores: dict[int, Likeness]) -> dict[str, float] | None:
    if not scores:
        return None
    each = [asdict(one) for one in scores.values()]
    return {name: float(np.mean([one[name] for one in each])) for name in each[0]}


def _finite(value: object) -> object:
    """The same without numbers that JSON does not have, and without numpy's."""
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in cast(dict[object, object], value).items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in cast(list[object], value)]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
