"""The scenes of an environment, loaded when they are drawn."""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import load_scene
from dreamdrive.tasks.environment.bicycle import EgoState
from dreamdrive.tasks.environment.course import Course, course_of
from dreamdrive.tasks.environment.options import EnvironmentOptions
from dreamdrive.tasks.environment.pictures import Pictures
from dreamdrive.tasks.environment.rig import Mount, scene_rig
from dreamdrive.tasks.environment.road import DrivableArea
from dreamdrive.trust import SceneTrust

Source = Scene | Path | str
Cameras = str | Sequence[Mount]
_PROBES_M = 3.0
_PROBE_TURN_RAD = 0.4


@dataclass
class Loaded:
    """A course, and what draws it once something is to be drawn."""

    course: Course
    pictures: Pictures | None = None
    trust: SceneTrust | None = None


class Courses:
    """Scenes by their number, of which the last few stay in memory."""

    def __init__(
        self,
        sources: Sequence[Source],
        roads: Sequence[DrivableArea | None] | None,
        cameras: Cameras,
        size_px: tuple[int, int],
        options: EnvironmentOptions,
    ) -> None:
        if not sources:
            raise InputError("scenes: none given; expected folders made by dreamdrive generate, or scenes")
        for each in sources:
            if not isinstance(each, Scene | Path | str):  # pyright: ignore[reportUnnecessaryIsInstance]
                raise InputError(f"scenes: {each!r}; expected folders made by dreamdrive generate, or scenes")
        if roads is not None and len(roads) != len(sources):
            raise InputError(f"roads: {len(roads)} for {len(sources)} scenes; expected one or None for each")
        self._sources = [each if isinstance(each, Scene) else _folder(Path(each)) for each in sources]
        self._roads = [None] * len(sources) if roads is None else list(roads)
        self._cameras, self._size_px, self._options = cameras, size_px, options
        self._loaded: OrderedDict[int, Loaded] = OrderedDict()

    def __len__(self) -> int:
        return len(self._sources)

    def course(self, index: int) -> Course:
        """The scene of a number, ready for driving."""
        return self._load(index).course

    def pictures(self, index: int) -> Pictures:
        """What draws a scene."""
        loaded = self._load(index)
        if loaded.pictures is None:
            loaded.pictures = self._drawn(loaded.course)
        return loaded.pictures

    def trust(self, index: int) -> SceneTrust:
        """How far views of a scene can be believed."""
        loaded = self._load(index)
        if loaded.trust is None:
            loaded.trust = SceneTrust.of(loaded.course.scene)
        return loaded.trust

    def clear(self) -> None:
        """Forget what was loaded."""
        self._loaded.clear()

    def _load(self, index: int) -> Loaded:
        if index in self._loaded:
            self._loaded.move_to_end(index)
            return self._loaded[index]
        source, options = self._sources[index], self._options
        scene = source if isinstance(source, Scene) else load_scene(source)
        name = f"scene {index}" if isinstance(source, Scene) else str(source)
        course = course_of(scene, name, self._roads[index], options.ego, options.road_margin_m)
        if course.path.times_s[-1] - course.path.times_s[0] + options.beyond_s < 2 * options.step_s:
            raise InputError(f"{name} is shorter than two steps of {options.step_s:g} s; give beyond_s")
        self._loaded[index] = Loaded(course)
        while len(self._loaded) > options.keep:
            self._loaded.popitem(last=False)
        return self._loaded[index]

    def _drawn(self, course: Course) -> Pictures:
        mounts = self._cameras
        if isinstance(mounts, str) or not mounts:
            only_front = mounts != "rig"
            mounts = scene_rig(course.scene, course.ego_from_front, self._size_px, only_front)
        pictures = Pictures(course.scene, mounts, self._options.pictures)
        pictures.leave_out(_probes(course, self._options))
        return pictures


def _folder(path: Path) -> Path:
    """The scene's own folder, of that or of the output of ``generate``."""
    for folder in (path, path / "scene"):
        if (folder / "scene.json").is_file():
            return folder
    raise InputError(f"{path} holds no scene; expected the folder that dreamdrive generate wrote")


def _probes(course: Course, options: EnvironmentOptions) -> list[Float[np.ndarray, "4 4"]]:
    """Poses of a car on and beside the path, looking along it and to both sides."""
    found: list[Float[np.ndarray, "4 4"]] = []
    aside_m = min(options.off_path_m, 2.5)
    for along_m in np.arange(0.0, course.path.length_m + options.beyond_m, _PROBES_M).tolist():
        x, y, yaw = course.path.at(np.array(along_m)).tolist()
        for aside, turned in ((0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            left = aside * aside_m
            state = EgoState(
                x - left * np.sin(yaw), y + left * np.cos(yaw), yaw + turned * _PROBE_TURN_RAD, 0.0
            )
            found.append(course.world_from_ego(state, along_m))
    return found
