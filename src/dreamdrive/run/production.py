"""The stages of ``generate``, and how its result gets into the output folder."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data import read_clip
from dreamdrive.files.paths import inside
from dreamdrive.machine import available_cores, free_bytes
from dreamdrive.progress import Progress, StageProgress, Work
from dreamdrive.run.cost import announcement, check_memory, plan
from dreamdrive.run.held_out import score_baselines, score_scene
from dreamdrive.run.in_motion import found_again
from dreamdrive.run.outcome import Outcome, outcome_of
from dreamdrive.run.report import describe
from dreamdrive.run.request import Request
from dreamdrive.run.stages import Stages
from dreamdrive.run.workspace import REPORT, Workspace
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.show import (
    Scored,
    draw_drives,
    draw_geometry,
    lens_of,
    write_held_out,
    write_png,
    write_videos,
)
from dreamdrive.stored import save_scene

T = TypeVar("T")

Say = Callable[[str], None]
"""Called with a sentence for somebody who waits."""

FIRST_PICTURE = "first.png"
"""In the folder of the stages: what the geometry shows, before anything is fitted."""


@dataclass(kw_only=True)
class Production(Stages):
    """Stages that show a first picture, and publish the scene they end with."""

    workspace: Workspace
    request: Request
    say: Say

    def _compute(self, name: str, key: str, compute: Callable[[Work], T]) -> T:
        value = super()._compute(name, key, compute)
        if isinstance(value, Geometry):
            picture = inside(self.folder, FIRST_PICTURE)
            write_png(picture, draw_geometry(self.results["prior"], value))
            self.say(f"A first picture is there, of the path, distances and what moves: {picture}")
        return value

    def publish(self, scene: Scene) -> Outcome:
        """Put scene, videos, held-out frames and report into the output folder, all at once."""
        request, staging = self.request, self.workspace.fresh_staging()
        clip: Clip = self.results["prior"]
        geometry: Geometry = self.results["geometry"]
        path = request.control.path
        scene = replace(scene, provenance=_about(path, clip, geometry, request.prior))

        def show(progress: Progress) -> None:
            save_scene(scene, staging / "scene")
            write_videos(staging / "video", scene, self._recorded(clip, scene), self._scored(), progress)
            write_held_out(staging / "held_out", scene, clip.source_index.tolist())
            write_png(staging / "report.png", draw_geometry(clip, geometry))
            if (drives := draw_drives(scene)) is not None:
                write_png(staging / "video" / "drives.png", drives)

        self.measure("videos", show)
        report = describe(
            clip,
            geometry,
            scene,
            {
                **request.document,
                "input": None if path is None else str(path),
                "prior": {"name": request.prior, "why": request.choice.why},
            },
            self.records,
            request.options.for_clip(clip).steps,
            score_scene(clip, geometry, scene),
            score_baselines(clip, geometry),
            found_again(clip, scene),
        )
        self.workspace.publish(report)
        return outcome_of(report, REPORT, already_finished=False)

    def _scored(self) -> Scored | None:
        """What the panel of the dynamic scores shows, where the representation has them."""
        if "score" not in self.results:
            return None
        threshold = self.request.options.group.threshold
        return Scored(self.results["static"].gaussians, self.results["score"], threshold)

    def _recorded(self, clip: Clip, scene: Scene) -> UInt8[np.ndarray, "f h w 3"]:
        """The frames in the source's distortion, at the clip's size."""
        control = self.request.control
        if lens_of(scene) is None or control.path is None:
            return clip.frames[scene.front]
        return read_clip(control.path, frames=control.frames, fps=control.fps, size=clip.size).frames


def start(
    workspace: Workspace, request: Request, recompute_from: str | None, progress: StageProgress, say: Say
) -> Production:
    """Say which prior it is, and what the run will cost where that is known before, and begin."""
    say(f"The prior is {request.prior}: {request.choice.why}.")
    planned = plan(request.control, request.prior)
    if planned is not None:
        check_memory(planned, free_bytes())
        if request.options.device == "cpu":  # where the times were measured
            for sentence in announcement(planned, request.options, available_cores()):
                say(sentence)
    return Production(
        workspace.stages,
        recompute_from,
        progress,
        workspace.claim,
        workspace=workspace,
        request=request,
        say=say,
    )


def _about(path: Path | None, clip: Clip, geometry: Geometry, prior: str) -> Provenance:
    return Provenance(
        input=None if path is None else path.name,
        source_index=tuple(clip.source_index.tolist()),
        lens=None if clip.recorded is None else clip.recorded.lens,
        up=None if geometry.ground is None else tuple(geometry.ground.normal_world.tolist()),
        scale=geometry.scale.source,
        camera_height_m=None if geometry.ground is None else geometry.ground.offset_m,
        log=clip.log,
        prior=prior if clip.recorded is None else None,
    )
