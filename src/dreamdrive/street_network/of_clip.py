"""Looks of the street network at a clip, and the cameras that follow from them."""

from dataclasses import replace

from dreamdrive.progress import Work
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.street.look import CameraEstimate, Look
from dreamdrive.street_network.look import look
from dreamdrive.street_network.shipped import NO_KNOWLEDGE, load_knowledge


def look_at(clip: Clip, knowledge: str, work: Work = Work()) -> tuple[Look, ...]:
    """A look for each camera of the rig, with ``knowledge`` as of ``load_knowledge``; none without it.

    Raises:
        InputError: The weights cannot be used.
    """
    if knowledge == NO_KNOWLEDGE:
        return ()
    network, looks = load_knowledge(knowledge), list[Look]()
    for index, camera in enumerate(clip.rig):
        frames, before = clip.frames[clip.of_camera(index)], sum(map(len, looks))

        def tell(done: int, _: int, before: int = before) -> None:
            work(before + done, len(clip))

        focal_px = camera.fx_px if clip.known.focal else None
        looks.append(look(frames, network, focal_px=focal_px, tell=tell))
    return tuple(looks)


def with_looks(clip: Clip, looks: tuple[Look, ...]) -> Clip:
    """The clip with what is seen in it; a camera of which nothing is told gets the focal length seen."""
    if not looks or clip.known.focal:
        return replace(clip, looks=looks)
    rig = tuple(_guessed(camera, seen.camera) for camera, seen in zip(clip.rig, looks, strict=True))
    return replace(clip, looks=looks, rig=rig)


def _guessed(camera: Camera, seen: CameraEstimate) -> Camera:
    stretch = camera.fy_px / camera.fx_px
    return replace(camera, fx_px=seen.focal_px, fy_px=seen.focal_px * stretch)
