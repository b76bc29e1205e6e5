"""What one browser does with a scene: edits, time, drive, path; nothing here knows the page."""

import math
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from dreamdrive.drive import MANOEUVRES, drives_of
from dreamdrive.edit import Edit, Move
from dreamdrive.errors import InputError
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.view.clock import Clock
from dreamdrive.view.road_path import drive_along

FREE, RECORDED, PATH = "free", "recorded", "path"
"""Who moves the camera: the mouse, or one of the drives."""
DRIFTS = (
    "The street of this scene moves as its pictures do, as no path of the camera was found: there are no "
    "tracks, no actors and no road to draw a path on."
)
STANDS = "Nothing in this scene moves on a track."


@dataclass
class Session:
    """A scene as one browser has it; the scene itself never changes, so that others see their own.

    Attributes:
        opened: The scene as it was opened.
        clock: Its time.
        drive: Who moves the camera.
        layer: What is shown.
        chosen: Id of the actor that was picked.
        points_m: Points of a path on the road, in the world.
        seconds: How long the drive along it takes.
    """

    opened: Scene
    clock: Clock = field(init=False)
    drive: str = RECORDED
    layer: str = "colour"
    chosen: int | None = None
    points_m: list[Float[np.ndarray, "3"]] = field(default_factory=list[np.ndarray])
    seconds: float = field(init=False)
    _made: list[tuple[Edit, Scene]] = field(default_factory=list[tuple[Edit, Scene]], init=False)
    _preview: Scene | None = field(default=None, init=False)
    _drives: dict[str, Trajectory] = field(default_factory=dict[str, Trajectory], init=False)

    _drawn: tuple[tuple[float, bytes], Trajectory] | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        path = self.opened.trajectory
        self.clock = Clock(float(path.times_s[0]), float(path.times_s[-1]))
        self.seconds = max(self.clock.last_s - self.clock.first_s, 1.0)

    @property
    def scene(self) -> Scene:
        """The scene with all edits made, and the one that is being tried."""
        return self._preview or self._settled

    @property
    def _settled(self) -> Scene:
        return self._made[-1][1] if self._made else self.opened

    @property
    def edits(self) -> tuple[Edit, ...]:
        """The edits in their order."""
        return tuple(edit for edit, _ in self._made)

    @property
    def actors(self) -> tuple[Actor, ...]:
        """What can be picked."""
        return () if self.opened.moves_per_frame else self.scene.actors

    @property
    def why_no_actors(self) -> str | None:
        """Why nothing can be picked; None where something can."""
        if self.opened.moves_per_frame:
            return DRIFTS
        return None if self.opened.actors else STANDS

    def pick(self, id: int | None) -> None:
        """Choose an actor; one that is gone counts as none."""
        self._preview = None
        self.chosen = id if id in {actor.id for actor in self.actors} else None

    def edit(self, edit: Edit) -> None:
        """Make a change. The street behind an actor is filled when the scene is saved.

        Raises:
            InputError: It cannot be made; nothing has changed then.
        """
        if self.opened.moves_per_frame:
            raise InputError(DRIFTS)
        self._preview = None
        try:
            made = edit.of(self._settled)
        except ValueError as error:
            raise InputError(str(error)) from error
        self._made.append((edit, made))
        added = {actor.id for actor in made.actors} - {actor.id for actor in self._before.actors}
        self.pick(max(added) if added else self.chosen)

    @property
    def _before(self) -> Scene:
        """As it was before the last edit."""
        return self._made[-2][1] if len(self._made) > 1 else self.opened

    def undo(self) -> Edit | None:
        """Take the last change back; None where there is none."""
        self._preview = None
        taken = self._made.pop()[0] if self._made else None
        self.pick(self.chosen)
        return taken

    def drag(self, by_m: Float[np.ndarray, "3"], done: bool) -> None:
        """Try the chosen actor elsewhere, by a way in the world; ``done`` makes an edit of it.

        Raises:
            InputError: Nothing tells where it points.
        """
        if self.chosen is None:
            return
        scene = self._settled
        actor = scene.actor(self.chosen)
        ahead = actor.ahead(scene.up)
        if ahead is None:
            raise InputError(f"nothing tells where {actor.name} points: it has no box and hardly moves")
        ways = np.stack([ahead, np.cross(scene.up, ahead)], axis=1)
        ahead_m, left_m = np.linalg.lstsq(ways, by_m, rcond=None)[0].tolist()
        if not done:
            self._preview = scene.moved(self.chosen, ahead_m, left_m)
        elif math.hypot(ahead_m, left_m) > 0.01:
            self.edit(Move(self.chosen, round(ahead_m, 3), round(left_m, 3)))
        else:
            self._preview = None

    def follow(self, drive: str) -> None:
        """Let a drive move the camera, or the mouse; the time runs as long as the drive.

        Raises:
            InputError: There is no such drive, or the scene has not seen enough of it.
        """
        path = self.path_of(drive)
        self.drive = drive
        if path is not None:
            self.clock.span(float(path.times_s[0]), float(path.times_s[-1]))
        else:
            times_s = self.opened.trajectory.times_s
            self.clock.span(float(times_s[0]), float(times_s[-1]))

    def path_of(self, drive: str) -> Trajectory | None:
        """The way of the camera on a drive; None of the mouse."""
        if drive == FREE:
            return None
        if drive == PATH:
            return self.drawn()
        if drive == RECORDED:
            return self.opened.trajectory
        if drive not in self._drives:
            self._drives[drive] = drives_of(self.opened, [drive], 2.0, None)[0].path
        return self._drives[drive]

    def pose(self) -> Float[np.ndarray, "4 4"] | None:
        """Where the drive has the camera now; None where the mouse moves it."""
        path = self.path_of(self.drive)
        return None if path is None else path.at(np.array([self.clock.t_s]))[0]

    def drawn(self) -> Trajectory:
        """The drive along the path; ``InputError`` where it is none yet."""
        if self.opened.moves_per_frame:
            raise InputError(DRIFTS)
        key = (self.seconds, np.array(self.points_m).tobytes())
        if self._drawn is None or self._drawn[0] != key:
            self._drawn = (key, drive_along(self.opened, self.points_m, self.seconds))
        return self._drawn[1]

    def add_point(self, place_m: Float[np.ndarray, "3"]) -> None:
        """One more point, at the end of the path.

        Raises:
            InputError: The scene has no road.
        """
        if self.opened.moves_per_frame:
            raise InputError(DRIFTS)
        self.points_m.append(place_m)

    def camera(
        self, world_from_camera: Float[np.ndarray, "4 4"], fov_rad: float, size: tuple[int, int]
    ) -> Camera:
        """A pinhole with its principal point in the middle; the field of view is that of the height."""
        focal_px = 0.5 * size[1] / math.tan(0.5 * fov_rad)
        return Camera(focal_px, focal_px, 0.5 * size[0], 0.5 * size[1], *size, world_from_camera)


DRIVES = (RECORDED, FREE, *(name for name in MANOEUVRES if name != "forward"), PATH)
"""What the page offers, in its order; ``forward`` is the recorded one."""


def vertical_fov_rad(camera: Camera) -> float:
    """The field of view of a camera from top to bottom, as if its principal point lay in the middle."""
    return 2 * math.atan(0.5 * camera.height_px / camera.fy_px)
