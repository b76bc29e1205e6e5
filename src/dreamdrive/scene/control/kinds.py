"""What can be asked of each kind of input: a class a kind, and each field once."""

from dataclasses import KW_ONLY, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from dreamdrive.names import TrafficName
from dreamdrive.scene.control.action import Action

if TYPE_CHECKING:
    from dreamdrive.scene.trajectory import Trajectory

_UNITS = ("_m_s", "_deg")
"""Ends of the names of fields that flags do without."""


@dataclass(frozen=True)
class Typed:
    """How a field is given at the command line.

    Attributes:
        form: How its value is typed.
        usual: What holds without it, where that is the same for all priors.
    """

    form: str = ""
    usual: str = ""


_File = Annotated[Path | None, Typed("FILE")]


@dataclass(frozen=True)
class Frames:
    """Any input, and which of its frames are wanted.

    Attributes:
        path: A video, a folder of images, a photo or a layout; None where the prior needs no input.
        frames: Frames to use, counted from 0. Of what a prior makes STOP says how many are made.
        fps: Rate of the input in frames a second. It counts before the step of frames.
        size: Width and height of the frames in pixels. Without it recordings are 480 wide.
        hold_out: Withhold every N-th frame to measure predictions. Of those selected i mod N = N // 2.
        seed: Seed of everything random.
    """

    path: Path | None = None
    _: KW_ONLY
    frames: Annotated[str | None, Typed("START:STOP:STEP")] = None
    fps: Annotated[float | None, Typed("F")] = None
    size: Annotated[tuple[int, int] | None, Typed("WxH")] = None
    hold_out: Annotated[int | None, Typed("N")] = None
    seed: Annotated[int, Typed("S", "0")] = 0


@dataclass(frozen=True, kw_only=True)
class Optics:
    """What a camera took, and how it projects.

    Attributes:
        intrinsics: Calibration of the camera. JSON for the size of the input, COLMAP model, transforms.json.
        hfov_deg: Horizontal field of view, without a calibration.
    """

    intrinsics: _File = None
    hfov_deg: Annotated[float | None, Typed("DEG")] = None


@dataclass(frozen=True, kw_only=True)
class DataSetDrive:
    """A drive of a data set.

    Attributes:
        dataset: How the recording lies on disk. Without it that of dreamdrive's own that recognises it.
        scene: Which drive of a data set, by name or number. Numbers count from 0, see dreamdrive data list.
        cameras: Which of its cameras, such as front,front_left. Without it the one that looks ahead, and of
            magicdrive all.
    """

    dataset: Annotated[str | None, Typed()] = None
    scene: Annotated[str | None, Typed("NAME|N")] = None
    cameras: Annotated[str | None, Typed("all|NAME,...")] = None


@dataclass(frozen=True, kw_only=True)
class Driving:
    """What is driven on from a first frame.

    Attributes:
        trajectory: Path of the camera: JSON or TUM. A video model shall drive it, a replayed video was to,
            which takes KITTI and PandaSet as well.
        trajectories: Several paths from the first frame, a JSON list. Each is a drive of its own, and all
            become one scene.
        action: What the car shall do, such as command=left.
        actions: What the car shall do, such as command=left. Or speed=8,8,8,8 wheel=0,0,0.1,0.1 (m/s and
            radians, left is positive, at 0.5, 1, 1.5 and 2 s); ahead=4,8,12,16 right=0,0,0,1 (m);
            goal=0.5,0.55 (shares of the photo's width and height). Given more than once, each is a drive of
            its own from the same first frame, and all become one scene.
    """

    trajectory: Annotated["Path | Trajectory | None", Typed("FILE")] = None
    trajectories: _File = None
    action: Annotated[Action | None, Typed("TEXT")] = None
    actions: Annotated[tuple[Action, ...] | None, Typed("TEXT")] = None


@dataclass(frozen=True, kw_only=True)
class RecordingInput(DataSetDrive, Optics, Frames):
    """A video, a folder of images, or a drive of a data set.

    Attributes:
        poses: Known camera poses: JSON, TUM, KITTI or PandaSet.
        features: Features of the frames by another program. See docs/replay.md.
    """

    poses: _File = None
    features: _File = None


@dataclass(frozen=True, kw_only=True)
class PhotoInput(Driving, Optics, Frames):
    """A photo that is driven into.

    Attributes:
        view: Part of a panorama: degrees to the right, and up.
        traffic: Whether the road users of a photo go on. Vehicles along their lane, people along the street.
        traffic_speed_m_s: Speed of its vehicles in metres a second.
        fill: What fills what a photo does not show. inpaint, the default, is OpenCV, network one that ships;
            or a file of weights of dreamdrive train photo.
    """

    view: Annotated[tuple[float, float] | None, Typed("HEADING,PITCH")] = None
    traffic: Annotated[TrafficName | None, Typed(usual="flow")] = None
    traffic_speed_m_s: Annotated[float | None, Typed("M/S", "8")] = None
    fill: Annotated[str | None, Typed("network|inpaint|FILE")] = None


@dataclass(frozen=True, kw_only=True)
class StreetInput(DataSetDrive, Frames):
    """A layout, a scene of a data set of which boxes and map count, or no input: a street of its own."""


@dataclass(frozen=True, kw_only=True)
class VideoModelInput(Driving, Optics, Frames):
    """A photo, or the first frames, from which a video model goes on.

    Attributes:
        prompt: What a video model shall show, in words.
        steps: Steps of a video model's sampler.
        weights: The prior's network, a file or folder.
    """

    prompt: Annotated[str | None, Typed("TEXT")] = None
    steps: Annotated[int | None, Typed("N")] = None
    weights: Annotated[Path | None, Typed("PATH")] = None


WITHOUT_SAYING = frozenset({"seed", "weights"})
"""Fields that every prior takes."""


def fields_of(*kinds: type[Any]) -> frozenset[str]:
    """The names of all fields of kinds of input but those that every prior takes."""
    return frozenset(each.name for kind in kinds for each in fields(kind)) - WITHOUT_SAYING


def flag_of(name: str) -> str:
    """How a field is called at the command line: without its unit, and in the singular where it repeats."""
    unit = next((unit for unit in _UNITS if name.endswith(unit)), "")
    plain = "action" if name == "actions" else name.removesuffix(unit)
    return f"--{plain.replace('_', '-')}"
