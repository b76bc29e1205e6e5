"""What a user asks a prior for."""

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from dreamdrive.choices import TrafficName
from dreamdrive.errors import InputError
from dreamdrive.scene.action import Action
from dreamdrive.scene.trajectory import Trajectory

FILES = ("path", "intrinsics", "poses", "trajectory", "trajectories", "weights", "features", "knowledge")
"""Fields of ``Control`` that name files; they count by their content."""


@dataclass(frozen=True)
class Control:
    """The input of a prior and how to read it; ``None`` leaves a choice to the prior.

    Attributes:
        path: A video, a folder of images, a photo, a layout; ``None`` where the prior needs no input.
        dataset: Name of the data set that the path is of; without it see ``data.dataset_of``.
        scene: Which drive of a data set, by its name or its number.
        cameras: Which of its cameras, by their names with commas; ``all`` takes all.
        frames: ``START:STOP:STEP`` over the indices of the source, or of the frames that a prior makes.
        fps: Rate of the input in frames a second, before the step of ``frames``.
        size: Width and height of the clip in pixels.
        intrinsics: Calibration file of the input.
        poses: Pose file of the input.
        hfov_deg: Horizontal field of view in degrees, where there is no calibration.
        view: Heading and pitch in degrees of what is taken out of a panorama.
        trajectory: The wanted path of the camera or a file with it, for priors that make one.
        trajectories: File with several wanted paths from the same first frame, each a drive of its own.
        action: What the car shall do, for priors that take no path.
        actions: Several of these from the same first frame, each a drive of its own.
        traffic: ``"still"`` or ``"flow"``: whether the road users of a photo go on.
        traffic_speed_m_s: Speed of its vehicles then.
        fill: What fills what a photo does not show: ``"network"``, ``"inpaint"`` or a file of weights.
        prompt: What shall be seen, in words.
        steps: Steps of a diffusion sampler.
        weights: The prior's network, a file or folder.
        features: File with features of the input's frames.
        camera_height_m: Height of the camera above the road, for priors that make metres of it.
        knowledge: Weights of the street network, for priors that look at their input: a name or a file.
        hold_out: Withhold the selected frames i with i mod N = N // 2.
        seed: Seed of everything the prior draws.
    """

    path: Path | None = None
    dataset: str | None = None
    scene: str | None = None
    cameras: str | None = None
    frames: str | None = None
    fps: float | None = None
    size: tuple[int, int] | None = None
    intrinsics: Path | None = None
    poses: Path | None = None
    hfov_deg: float | None = None
    view: tuple[float, float] | None = None
    trajectory: Path | Trajectory | None = None
    trajectories: Path | None = None
    action: Action | None = None
    actions: tuple[Action, ...] | None = None
    traffic: TrafficName | None = None
    traffic_speed_m_s: float | None = None
    fill: str | None = None
    prompt: str | None = None
    steps: int | None = None
    weights: Path | None = None
    features: Path | None = None
    camera_height_m: float | None = None
    knowledge: str | None = None
    hold_out: int | None = None
    seed: int = 0

    @property
    def settings(self) -> dict[str, Any]:
        """What counts by its value: all but the files and the seed."""
        return {k: v for k, v in asdict(self).items() if k not in (*FILES, "seed")}

    def check_taken(self, takes: frozenset[str], by: str) -> None:
        """Refuse what is given and not taken; ``seed`` and ``weights`` go without saying."""
        given = [field.name for field in fields(self) if getattr(self, field.name) is not None]
        if refused := [name for name in given if name not in takes | {"seed", "weights"}]:
            raise InputError(f"{by} takes no {' and no '.join(refused)}; it takes {', '.join(sorted(takes))}")
