"""The stages of ``generate``, and how its result gets into the output folder."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import UInt8

from dreamdrive.build import Built
from dreamdrive.compute.device import chosen_device
from dreamdrive.compute.machine import available_cores, free_bytes
from dreamdrive.data import read_clip
from dreamdrive.files.paths import inside
from dreamdrive.fit import check_fit
from dreamdrive.prior import NAMED, Choice, choose_prior
from dreamdrive.progress import Progress, StageProgress
from dreamdrive.run.report.cost import announcement, announcement_of_gpu, check_memory, fit_of
from dreamdrive.run.report.document import describe, facts_about
from dreamdrive.run.report.held_out import score_baselines, score_scene
from dreamdrive.run.report.in_motion import found_again
from dreamdrive.run.report.outcome import PICTURE, Outcome, outcome_of
from dreamdrive.run.report.shift import shift_of
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

Say = Callable[[str], None]
"""Called with a sentence for somebody who waits."""

FIRST_PICTURE = "first.png"
"""In the folder of the stages: what the geometry shows, before anything is fitted."""


@dataclass(kw_only=True)
class Production(Stages):
    """Stages that show a first picture, and publish the scene they end with."""

    workspace: Workspace
    request: Request

    def show_first(self, clip: Clip, geometry: Geometry) -> None:
        """Write and tell of a picture of what was found before anything is fitted."""
        picture = inside(self.folder, FIRST_PICTURE)
        write_png(picture, draw_geometry(clip, geometry))
        self.say(f"A first picture is there, of the path, distances and what moves: {picture}")

    def publish(self, built: Built) -> Outcome:
        """Put scene, videos, held-out frames and report into the output folder, all at once."""
        request, staging = self.request, self.workspace.fresh_staging()
        clip, geometry = built.clip, built.geometry
        path = request.control.path
        scene = replace(built.scene, provenance=_about(path, clip, geometry, request.prior))
        there = scene.on(chosen_device())
        held_out, baselines = score_scene(clip, geometry, there), score_baselines(clip, geometry)
        again, options = found_again(clip, there), request.document["options"]
        facts = facts_about(clip, geometry, scene, options, held_out, baselines, again)
        shift = shift_of(scene, facts)

        def show(progress: Progress) -> None:
            save_scene(scene, staging / "scene")
            recorded = self._recorded(clip, scene)
            videos = staging / "video"
            write_videos(videos, there, recorded, self._scored(built), progress, shift_m=shift.right_m)
            write_held_out(staging / "held_out", there, clip.source_index.tolist())
            write_png(staging / PICTURE, draw_geometry(clip, geometry, scene))
            if (drives := draw_drives(there)) is not None:
                write_png(videos / "drives.png", drives)

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
            held_out,
            baselines,
            again,
            shift,
            self.whole_s,
        )
        self.workspace.publish(report)
        done = outcome_of(report, REPORT, already_finished=False)
        return replace(done, picture=self.workspace.out / PICTURE)

    def _scored(self, built: Built) -> Scored | None:
        """What the panel of the dynamic scores shows, where the representation has them."""
        if built.scores is None:
            return None
        gaussians, device = built.static.gaussians, chosen_device()
        return Scored(gaussians.to(device), built.scores.to(device), self.request.options.group.threshold)

    def _recorded(self, clip: Clip, scene: Scene) -> UInt8[np.ndarray, "f h w 3"]:
        """The frames in the source's distortion, at the clip's size."""
        control, taken = self.request.control, clip.recorded
        if lens_of(scene) is None or control.path is None or taken is None:
            return clip.frames[scene.front]
        read = read_clip(control.path, frames=control.frames, fps=control.fps, size=clip.size)
        kept = read.frames[np.isin(read.source_index, clip.source_index)]
        return kept[:, ::-1, ::-1] if taken.turned else kept


def start(
    workspace: Workspace, request: Request, recompute_from: str | None, progress: StageProgress, say: Say
) -> Production:
    """Say which prior it is, and what the run will cost where that is known before, and begin."""
    say(_whose_frames(request.choice))
    planned, options = request.input.plan, request.options
    if planned is not None:
        check_memory(planned, free_bytes())
        if options.device == "cpu":  # where the times were measured
            for sentence in announcement(planned, options, available_cores()):
                say(sentence)
        else:
            check_fit(fit_of(planned, options), free_bytes(torch.device(options.device)), least=True)
            say(announcement_of_gpu(planned, options))
    return Production(
        workspace.stages,
        recompute_from,
        progress,
        workspace.claim,
        workspace=workspace,
        request=request,
        say=say,
    )


def _whose_frames(choice: Choice) -> str:
    """Where the frames come from, and why from there, in a sentence."""
    if choice.name == "replay":
        return "The frames are those of the recording."
    about = f"The frames come from the prior {choice.name}: {choose_prior(choice.name).about}."
    return about if choice.why == NAMED else f"{about} It was chosen as {choice.why}."


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
