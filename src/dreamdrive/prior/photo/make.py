"""The clip of a drive into a photo."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.data.cameras.intrinsics import GUESSED
from dreamdrive.data.frames.select import Selection, held_out_mask
from dreamdrive.data.photo import Photo, read_photo
from dreamdrive.data.pictures.turned import turned_photo
from dreamdrive.errors import InputError
from dreamdrive.names import FILL_INPAINT
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.pca import reduce
from dreamdrive.prior.photo.fill import grown
from dreamdrive.prior.photo.height import Height, height_of
from dreamdrive.prior.photo.layers import Layers, layers_of
from dreamdrive.prior.photo.network import Before, PhotoNetwork, load_photo_network, mended
from dreamdrive.prior.photo.sight import Sight, sight_of
from dreamdrive.prior.photo.street import PhotoStreet, street_of
from dreamdrive.prior.photo.traffic import TRAFFIC, going_ahead, velocities_of
from dreamdrive.prior.photo.unseen import unseen_of
from dreamdrive.prior.photo.way import path_for
from dreamdrive.prior.protocol import Input, Seeing
from dreamdrive.progress import Progress
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Control, check_video_size
from dreamdrive.scene.geometry import Basis, Scale
from dreamdrive.scene.street.look import Look
from dreamdrive.scene.street.street_class import FLAT, StreetClass
from dreamdrive.street_network import HALF_TURN, NO_KNOWLEDGE, load_knowledge, look, turns_to_upright

FRAMES = 25
RATE_HZ = 10.0
SIZE = (480, 270)
_MOST_FRAMES = 1000
_HALF = 0.5
_Drawn = tuple[
    UInt8[np.ndarray, "f h w 3"],
    Float[np.ndarray, "f h w"],
    Bool[np.ndarray, "f h w"],
    Bool[np.ndarray, "f h w"],
]
"""Frames, depth, sky and what moves."""
_LEAST_SOLID, _LITTLE_GROUND = 0.05, 0.05
_LEAST_CONTRAST = 3.0  # grey levels: a street at night has more


def make_clip(opened: Input, progress: Progress, seeing: Seeing) -> Clip:
    """The frames of a drive, with the poses, depth, sky and road that they were drawn from."""
    control = opened.control
    if control.path is None:
        raise InputError("the prior photo needs an input: a photo of a street")
    if seeing.knowledge == NO_KNOWLEDGE:
        raise InputError("the prior photo sees depth by the street network; leave --knowledge none out")
    size = control.size or SIZE
    check_video_size(size)
    wanted = _wanted(control.frames)
    photo = _read(control.path, control, size, seeing.knowledge)
    street, seen, height = seen_in(photo, seeing.knowledge, seeing.camera_height_m)
    velocities = velocities_of(street, control.traffic or TRAFFIC, control.traffic_speed_m_s)
    ahead = going_ahead(street, velocities)
    path = path_for(control, street, wanted / RATE_HZ, gone=ahead)
    layers = layers_of(street, leaving=ahead)
    network = None if control.fill in (None, FILL_INPAINT) else load_photo_network(control.fill)
    later = (layers.at(float(t_s), velocities) for t_s in wanted / RATE_HZ)
    drawn, inner = _driven(street, later, path.world_from_camera, network, progress)
    frames, depth_m, sky, moving = drawn
    first = np.linalg.inv(path.world_from_camera[0])
    cameras = [street.camera.at(pose) for pose in path.world_from_camera]
    valid = np.ones(frames.shape[:3], bool)
    guessed = not (photo.calibrated or photo.hfov)
    return Clip(
        frames=frames,
        times_s=(wanted - wanted[0]) / RATE_HZ,
        camera=np.zeros(len(wanted), np.int64),
        rig=(street.camera,),
        valid=valid,
        held_out=held_out_mask(len(wanted), control.hold_out),
        source_index=wanted,
        features={"appearance": appearance(frames, valid)} | ({"photo:last": reduce(inner)} if inner else {}),
        known=Known(
            world_from_camera=first @ path.world_from_camera,
            intrinsics=True,
            depth_m=depth_m,
            sky=sky,
            unseen=unseen_of(layers, velocities, cameras, depth_m) if np.allclose(first, np.eye(4)) else None,
            generated=True,
            scale=_scale(seeing, seen, height, guessed=guessed),
            focal_guessed=guessed,
        ),
        requested=path if control.trajectory is not None else None,
        set_in_motion=moving,
        provenance={
            "prior": "photo",
            "notes": _notes(seeing, photo, seen, height, velocities),
            "set_in_motion": int(velocities.any(1).sum()),
        },
    )


def _read(path: Path, control: Control, size: tuple[int, int], knowledge: str) -> Photo:
    """The photo, turned by half where the camera hung upside down."""
    photo = read_photo(path, size, control.intrinsics, control.hfov_deg, control.view)
    turns = turns_to_upright(photo.rgb[None], load_knowledge(knowledge))
    return turned_photo(photo) if turns == HALF_TURN else photo


def seen_in(photo: Photo, knowledge: str, height_m: float | None) -> tuple[PhotoStreet, Look, Height]:
    """The street of a photo, what the network saw in it, and how high the camera is, unless that is told.

    Raises:
        InputError: Nothing solid is seen.
    """
    if float(photo.rgb.std(axis=(0, 1)).max()) < _LEAST_CONTRAST:
        raise InputError("the photo is of one colour, or dark all over; expected a street, seen from a car")
    told = photo.calibrated or photo.hfov
    seen = look(photo.rgb[None], knowledge, focal_px=photo.camera.fx_px if told else None)
    camera = photo.camera
    if not told:
        stretch = camera.fy_px / camera.fx_px
        camera = replace(camera, fx_px=seen.camera.focal_px, fy_px=seen.camera.focal_px * stretch)
    height = height_of(seen, camera) if height_m is None else Height(height_m, 0.0, 0)
    street = street_of(photo.rgb, camera, seen, height.metres)
    if float((street.depth_m > 0).mean()) < _LEAST_SOLID:
        raise InputError(
            "the photo shows nothing solid: nearly all of it is taken for sky or for the own car; "
            "expected a street, seen from a car"
        )
    return street, seen, height


def _wanted(frames: str | None) -> Int[np.ndarray, " f"]:
    """Indices of the frames to make, counted from the photo."""
    selection = Selection.parse(frames)
    if selection.needs_count:
        raise InputError(f"--frames {frames}: count from the photo; there is no last frame")
    if selection.stop is None:
        selection = replace(selection, stop=max(FRAMES, selection.start + FRAMES))
    wanted = selection.resolve(None, "the drive")
    if len(wanted) < 2 or wanted[-1] >= _MOST_FRAMES:
        raise InputError(
            f"--frames {frames} asks for {len(wanted)} frames up to number {wanted[-1]}; expected two or "
            f"more below {_MOST_FRAMES}"
        )
    return np.array(wanted, np.int64)


def _driven(
    street: PhotoStreet,
    layers: Iterable[Layers],
    poses: Float[np.ndarray, "f 4 4"],
    network: PhotoNetwork | None,
    progress: Progress,
) -> tuple[_Drawn, list[Float[np.ndarray, "h2 w2 c"]]]:
    """What the layers are at each pose, the photo itself where it was taken; and features of the network."""
    drawn, inner, before = list[tuple[np.ndarray, ...]](), list[np.ndarray](), None
    for number, (now, pose) in enumerate(zip(layers, poses, strict=True)):
        camera = street.camera.at(pose)
        frame, sight = view(now, camera, street)
        if network is not None:
            plain, (frame, features) = frame, mended(network, sight, camera, before)
            before = Before(plain, camera)
            inner.append(features)
        if np.allclose(pose, np.eye(4)) and not now.carried_m.any():
            own = grown(street.classes == StreetClass.OWN_CAR, 5)
            frame = np.where(own[..., None], frame, street.rgb)
        drawn.append((frame, sight.depth_m, sight.sky, sight.moving))
        progress(number + 1, len(poses))
    frames, depth_m, sky, moving = (np.stack(each) for each in zip(*drawn, strict=True))
    return (frames, depth_m, sky, moving), inner


def view(layers: Layers, camera: Camera, street: PhotoStreet) -> tuple[UInt8[np.ndarray, "h w 3"], Sight]:
    """What a camera sees, with its holes filled from around them."""
    sight = sight_of(layers, camera, street.ground)
    return sight.filled, sight


def _scale(seeing: Seeing, seen: Look, height: Height, *, guessed: bool) -> Scale:
    """What metres rest on: a camera of another height, or a wider view, is a street of another size."""
    focal_spread = seen.camera.focal_spread if guessed else 0.0
    if seeing.camera_height_m is not None:
        return Scale(f"camera height {height.metres:.2f} m (given)", focal_spread, basis="height")
    source = f"camera height of {height.metres:.2f} m (by {_told_by(height)})"
    basis: Basis = "seen sizes" if height.road_users or height.lanes else "usual height"
    return Scale(source, float(np.hypot(height.spread, focal_spread)), basis=basis)


def _told_by(height: Height) -> str:
    road_users = (
        "the size of 1 road user"
        if height.road_users == 1
        else f"the sizes of {height.road_users} road users"
    )
    lanes = "the width of 1 lane" if height.lanes == 1 else f"the widths of {height.lanes} lanes"
    told = [words for words, count in ((road_users, height.road_users), (lanes, height.lanes)) if count]
    return " and ".join(told) or "what is usual"


def _notes(
    seeing: Seeing, photo: Photo, seen: Look, height: Height, velocities: Float[np.ndarray, "u 3"]
) -> list[str]:
    notes = [note for note in photo.notes if note != GUESSED]  # the street network guesses better
    notes.append("The frames are drawn from one photo: what it does not show is made up.")
    if float(np.isin(seen.classes[0], FLAT).mean()) < _LITTLE_GROUND:
        notes.append("Hardly any ground is seen in the photo: the road is a guess, and so are all distances.")
    if not (photo.calibrated or photo.hfov):
        spread = 100 * seen.camera.focal_spread
        notes.append(
            f"The field of view, {np.rad2deg(seen.camera.hfov_rad):.0f} degrees, is what the street network "
            f"takes the photo for (focal length within {spread:.0f} %); --hfov tells it."
        )
    if seen.camera.distorted > _HALF:
        notes.append(
            "The lens seems to bend straight lines: what is near the borders will be off; --intrinsics takes "
            "the bend out."
        )
    if seeing.camera_height_m is None:
        by = _told_by(height)
        notes.append(
            f"Metres rest on a camera {height.metres:.2f} m above the road, by {by} (within "
            f"{100 * height.spread:.0f} %); --camera-height tells it."
        )
    if moving := int(velocities.any(1).sum()):
        notes.append(
            f"{moving} of {len(velocities)} road users were set in motion; where they go is made up, and "
            "--traffic still leaves them in place."
        )
    return notes
