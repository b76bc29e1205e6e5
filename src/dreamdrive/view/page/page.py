"""One browser: its camera, its pictures, and the panels beside them."""

import time
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from viser import CameraHandle, ClientHandle

from dreamdrive.errors import InputError
from dreamdrive.show import Image
from dreamdrive.view.layers import LAYERS, Looking
from dreamdrive.view.page.actor_panel import ActorPanel
from dreamdrive.view.page.lines import Lines, wxyz
from dreamdrive.view.page.pace import PictureSize
from dreamdrive.view.page.path_panel import PathPanel
from dreamdrive.view.page.talk import Talk
from dreamdrive.view.page.time_panel import BESIDE, OVER, TimePanel
from dreamdrive.view.page.tools import Shared, Tools
from dreamdrive.view.recorded import RecordedFrames, nearest_view
from dreamdrive.view.session import FREE, RECORDED, Session, vertical_fov_rad

REST_S = 0.25
"""How long the camera has to rest until a large picture is drawn."""
MOST_HZ = 25.0
"""Pictures a second while the time runs."""
_MOVING_QUALITY, _RESTING_QUALITY, _BESIDE_PX = 75, 88, 420
_SAME_M, _SAME = 0.02, 1e-3
_LOOK_M, _MOST_TRIES, _AGAIN_S = 10.0, 60, 1.0


@dataclass
class Page:
    """The page of one browser."""

    client: ClientHandle
    shared: Shared
    tools: Tools = field(init=False)
    talk: Talk = field(init=False)
    session: Session = field(init=False)
    recorded: RecordedFrames = field(init=False)
    lines: Lines = field(init=False)
    _looking: Looking = field(init=False)
    _pace: PictureSize = field(default_factory=PictureSize, init=False)
    _own: tuple[np.ndarray, np.ndarray] = field(init=False)
    _placed: tuple[np.ndarray, np.ndarray] | None = field(default=None, init=False)
    _confirmed: bool = field(default=False, init=False)
    _tries: int = field(default=0, init=False)
    _window: tuple[int, int] = field(default=(0, 0), init=False)
    _beside: int = field(default=-1, init=False)
    _open: bool = field(default=True, init=False)

    def __post_init__(self) -> None:
        scene = self.shared.scene
        self.talk, self.session = Talk(self.client), Session(scene)
        self._own = np.array(self.client.camera.position), _ahead(self.client.camera)
        self._looking = Looking(self.shared.kept)
        self.recorded = RecordedFrames(self.shared.kept, scene)
        with self.talk.lock, self.client.atomic():
            self.client.scene.set_up_direction(tuple(scene.up.tolist()))
            self.client.camera.up_direction = scene.up
            self.client.camera.fov = vertical_fov_rad(scene.cameras[0])
            self.lines = Lines(self.client, scene, self.pick, self.jump)
            self.tools = Tools(self.client, self.shared, self.session, self.talk, self.lines, self.refresh)
            self.time_panel = TimePanel(self.tools, self.recorded.there)
            self.actor_panel = ActorPanel(self.tools)
            self.path_panel = PathPanel(self.tools, self.time_panel)
            self.tools.show_actors()
        self.client.camera.on_update(self._camera_moved)

    def close(self) -> None:
        """The browser went away."""
        with self.talk.lock:
            self._open = False
            self.session.clock.pause()
        self.shared.frames.drop(self)

    def __hash__(self) -> int:
        return id(self)

    def __eq__(self, other: object) -> bool:
        return self is other

    def refresh(self) -> None:
        """Draw soon."""
        self.shared.frames.ask(self, self._draw)

    def pick(self, id: int) -> None:
        """An actor was clicked."""
        self.talk.alone(lambda: self.actor_panel.choose(id))

    def jump(self, view: int) -> None:
        """A recorded view was clicked: look out of it."""

        def there() -> None:
            scene = self.shared.scene
            self.session.clock.pause()
            front = np.flatnonzero(scene.front == view)
            self.session.follow(RECORDED if len(front) else FREE)
            self.session.clock.set(float(scene.times_s[view]))
            if not len(front):
                self._place(scene.cameras[view].world_from_camera)
            self.time_panel.tell()
            self.refresh()

        self.talk.alone(there)

    def _camera_moved(self, camera: CameraHandle) -> None:
        """The browser tells where its camera is: as it was placed, or as the mouse moved it."""
        with self.talk.lock:
            window = (int(camera.image_width), int(camera.image_height))
            resized, self._window = window != self._window, window
            by_hand = self._is_by_hand(camera)
            if by_hand and self.session.drive != FREE:
                self.session.follow(FREE)
                self.time_panel.tell()
            if resized or by_hand or self._is_lost():
                self.refresh()

    def _is_lost(self) -> bool:
        """Whether the browser has yet to tell that it is where a drive has put it."""
        return self.session.drive != FREE and not self._confirmed and self._tries <= _MOST_TRIES

    def _is_by_hand(self, camera: CameraHandle) -> bool:
        """Whether the mouse has moved it, and not the drive.

        A browser tells late where a drive has put its camera, and in between its steps: only after it has
        told of the last step is another place one of the mouse's.
        """
        if self.session.drive == FREE:
            return True
        if self._placed is None:
            return False
        if _is_at(camera, *self._own):  # a slow browser may forget where it was put, and begin again
            self._confirmed = False
        there = _is_at(camera, *self._placed)
        by_hand, self._confirmed = self._confirmed and not there, self._confirmed or there
        return by_hand

    def _place(self, pose: Float[np.ndarray, "4 4"]) -> None:
        """Put the browser's camera at a pose."""
        camera, here = self.client.camera, pose[:3, 3]
        before, self._placed = self._placed, (here.copy(), pose[:3, 2].copy())
        same = before is not None and all(map(np.allclose, before, self._placed))
        self._tries = self._tries + 1 if same else 0
        if same and (self._confirmed or self._tries > _MOST_TRIES):
            return
        self._confirmed = False
        camera.position = here
        if before is None:  # the mouse turns the camera about this place
            camera.look_at = here + _LOOK_M * pose[:3, 2]
        camera.wxyz = wxyz(pose[:3, :3])

    def _pose(self) -> Float[np.ndarray, "4 4"]:
        """Where the camera is: on its drive, or where the mouse has it."""
        pose = self.session.pose()
        if pose is None:
            pose = np.eye(4)
            pose[:3, :3] = Rotation.from_quat(self.client.camera.wxyz, scalar_first=True).as_matrix()
            pose[:3, 3] = self.client.camera.position
        return pose

    def _draw(self, resting: bool = False) -> None:
        """One picture, and the wish for the next one while the time runs."""
        with self.talk.lock:
            if not self._open:
                return
            begun_s, session = time.monotonic(), self.session
            t_s, scene, layer = session.clock.tick(), session.scene, session.layer
            pose = self._pose()
            window = (int(self.client.camera.image_width), int(self.client.camera.image_height))
            size = self._pace.size(window, resting)
            camera = session.camera(pose, self.client.camera.fov, size)
        try:
            picture = LAYERS[layer].draw(self._looking, scene, camera, t_s)
            if self.time_panel.beside == OVER:
                picture = self.recorded.over(picture, camera, t_s)
            frame = self._frame_beside(t_s)
        except InputError as error:
            return self._give_up(str(error))
        self._send(picture, frame, pose, t_s, resting)
        if not resting:
            self._pace.took(time.monotonic() - begun_s)
        self._next(begun_s, resting)

    def _next(self, begun_s: float, resting: bool) -> None:
        """Ask for the next picture while the time runs, and for a large one when all rests."""
        with self.talk.lock:
            frames, took_s = self.shared.frames, time.monotonic() - begun_s
            if self.session.clock.playing:
                frames.ask(self, self._draw, max(0.0, 1 / MOST_HZ - took_s))
            elif not resting and not frames.asks(self):
                frames.ask(self, partial(self._draw, True), REST_S)
            elif self._is_lost() and not frames.asks(self):
                frames.ask(self, self._put_again, _AGAIN_S)

    def _put_again(self) -> None:
        """Tell the browser once more where its camera is; what it shows is there already."""
        with self.talk.lock:
            pose = self.session.pose()
            if self._open and pose is not None and self._is_lost():
                with self.client.atomic():
                    self._place(pose)
                self.shared.frames.ask(self, self._put_again, _AGAIN_S)

    def _give_up(self, why: str) -> None:
        """Go back to what every scene has."""
        with self.talk.lock:
            self.session.layer = "colour"
            self.session.clock.pause()
            self.time_panel.beside = ""
            self.time_panel.tell()
        self.talk.refuse(why)

    def _frame_beside(self, t_s: float) -> tuple[int, Image] | None:
        """The recorded frame to show in the panel, where it is another one than before."""
        if self.time_panel.beside != BESIDE:
            self._beside = -1
            return None
        if nearest_view(self.shared.scene, t_s) == self._beside:
            return None
        view, frame = self.recorded.nearest(t_s)
        self._beside = nearest_view(self.shared.scene, t_s)
        return view, frame[:: max(1, frame.shape[1] // _BESIDE_PX), :: max(1, frame.shape[1] // _BESIDE_PX)]

    def _send(
        self,
        picture: Image,
        frame: tuple[int, Image] | None,
        pose: Float[np.ndarray, "4 4"],
        t_s: float,
        resting: bool,
    ) -> None:
        """Picture, camera, boxes and time, all at once."""
        quality = _RESTING_QUALITY if resting else _MOVING_QUALITY
        with self.talk.lock, self.client.atomic():
            if self.session.drive != FREE:
                self._place(pose)
            self.client.scene.set_background_image(picture, format="jpeg", jpeg_quality=quality)
            self.lines.at(t_s)
            self.lines.show_views(self.time_panel.shows_views)
            self.time_panel.at(t_s, frame)


def _is_at(camera: CameraHandle, place: Float[np.ndarray, "3"], ahead: Float[np.ndarray, "3"]) -> bool:
    return np.allclose(camera.position, place, atol=_SAME_M) and np.allclose(
        _ahead(camera), ahead, atol=_SAME
    )


def _ahead(camera: CameraHandle) -> Float[np.ndarray, "3"]:
    return Rotation.from_quat(camera.wxyz, scalar_first=True).as_matrix()[:, 2]
