"""Labels of the drive that a scene was made of, of all that the scene does not hold as actors."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.export.log import MOVING_M_S, Moved
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.log import BoxTrack, Log, LogMap, OfLog

_LEAST_M = 1.0
"""So far from a labelled thing, or half its length where that is more, an actor is still the same ..."""
_OF_DEPTH = 0.15
"""... and by this share of its distance from the camera farther from one that moves: along the view, depth of
actors is off by metres."""


@dataclass(frozen=True)
class Labels:
    """What is labelled around a scene, in the world of its drive.

    Attributes:
        link: Where the scene lies in the drive.
        location: Which map the drive is on.
        map: Of the surroundings.
        boxes: Things that the scene does not hold as actors.
    """

    link: OfLog
    location: str
    map: LogMap
    boxes: tuple[BoxTrack, ...]

    def at(self, times_s: Float[np.ndarray, " t"]) -> list[Moved]:
        """The things at times of the scene, between their labels; there only from the first to the last."""
        made = [self._at(box, times_s + self.link.start_s) for box in self.boxes]
        return [each for each in made if each.there.any()]

    def _at(self, box: BoxTrack, times_s: Float[np.ndarray, " t"]) -> Moved:
        poses = [box.pose_at(float(t)) for t in times_s]
        rows = [box.row_at(float(t)) for t in times_s]
        size_m = np.median(box.size_lwh_m, axis=0)
        known = zip(poses, rows, strict=True)
        placed = np.stack([box.world_from_box[row] if pose is None else pose for pose, row in known])
        if self.link.level_z_m is not None:
            placed = _standing(placed, self.link.level_z_m + size_m[2] / 2)
        there = np.array([pose is not None for pose in poses])
        words = tuple(box.attributes[row] for row in rows)
        return Moved(box.id, box.category, size_m, placed, there, words)


def labels_of(scene: Scene, drive: Log, *, edited: bool = False) -> Labels:
    """The labels of a drive, less what the scene holds as actors; give it as it was made, with all of them.

    Of a scene whose actors were ``edited`` nobody knows any more where they were: then nothing that moves in
    the drive is taken, so that what was removed does not come back as a label.

    Raises:
        InputError: The scene was made of another drive, or of none.
    """
    link = scene.provenance.log
    if link is None or link.name != drive.name:
        of = "no drive of a data set" if link is None else link.name
        raise InputError(
            f"the scene was made of {of}, the labels are of {drive.name}; give those of its drive"
        )
    held = {id for actor in scene.actors for id in _held(actor, scene, drive, link)}
    kept = [box for box in drive.boxes if box.id not in held and not (edited and _moves(box))]
    return Labels(link, drive.location, drive.map, tuple(kept))


def _moves(box: BoxTrack) -> bool:
    way_m = np.linalg.norm(np.diff(box.world_from_box[:, :2, 3], axis=0), axis=1)
    return bool((way_m > MOVING_M_S * np.diff(box.times_s)).any()) or bool((box.moves > 0).any())


def _held(actor: Actor, scene: Scene, drive: Log, link: OfLog) -> set[str]:
    """What an actor stands for: the nearest label that moves, and whatever is labelled at its very place."""
    camera_m = scene.trajectory.at(actor.track.times_s)[:, :3, 3]
    slack_m = _OF_DEPTH * float(np.median(np.linalg.norm(actor.track.positions_m - camera_m, axis=1)))
    beyond_m = {box.id: _beyond_m(box, actor, link) for box in drive.boxes}
    found = {id for id, away_m in beyond_m.items() if away_m < 0}
    moving = [box.id for box in drive.boxes if _moves(box) and beyond_m[box.id] < slack_m]
    return found | set(sorted(moving, key=lambda id: beyond_m[id])[:1])


def _beyond_m(box: BoxTrack, actor: Actor, link: OfLog) -> float:
    """How much farther an actor is from a labelled thing than the same may be; median of common times."""
    log_from_world = np.array(link.log_from_world)
    places_m = actor.track.positions_m @ log_from_world[:3, :3].T + log_from_world[:3, 3]
    away_m = [
        float(np.linalg.norm(place[:2] - pose[:2, 3]))
        for place, time_s in zip(places_m, actor.track.times_s, strict=True)
        if (pose := box.pose_at(float(time_s) + link.start_s)) is not None
    ]
    same_m = max(_LEAST_M, float(box.size_lwh_m[:, 0].max()) / 2)
    return float(np.median(away_m)) - same_m if away_m else np.inf


def _standing(poses: Float[np.ndarray, "t 4 4"], z_m: float) -> Float[np.ndarray, "t 4 4"]:
    """The same places and headings, upright at a height."""
    yaw = np.arctan2(poses[:, 1, 0], poses[:, 0, 0])
    made = np.tile(np.eye(4), (len(poses), 1, 1))
    made[:, 0, 0] = made[:, 1, 1] = np.cos(yaw)
    made[:, 1, 0], made[:, 0, 1] = np.sin(yaw), -np.sin(yaw)
    made[:, :2, 3], made[:, 2, 3] = poses[:, :2, 3], z_m
    return made
