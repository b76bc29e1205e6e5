"""An actor of another scene, set on the road of this one."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.motion import DeformationConfig, DeformationField, Domain, Motion, multiply_quaternions
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Scene

_ROAD_M, _NEAR_M, _LEAST = 0.2, 20.0, 50
"""What counts as road: so near to its plane, so near to the path, and so many Gaussians of it."""
_MOST_GAIN = 2.0
_NO_METRES = "none"


@dataclass(frozen=True)
class SetPlace:
    """Where an actor is set: metres ahead of and to the left of the first camera, and when it is there.

    None is when the scene begins.
    """

    ahead_m: float
    left_m: float
    at_s: float | None = None


def digest_of_scene(folder: Path) -> str:
    """What tells the scene in a folder from any other: the checksum of its index."""
    return str(read_json(folder / "scene.json", follow=False).get("sha256", ""))


def inserted(scene: Scene, other: Scene, id: int, place: SetPlace) -> Scene:
    """The scene with an actor of another one, the last of its actors; its first place is the one given.

    It drives as it did there, its way turned from the direction of the first camera there to that of the one
    here, on the road of this scene. It is as much brighter as the road here is. Its surface is as it was at
    the time of each Gaussian, and rigid. Where a life span ends it ends, counted from its first time.

    Raises:
        InputError: Metres or the road of a scene are not known, or it drifts.
        ValueError: There is no such actor, or what moves the scene knows no tracks.
    """
    actor = other.actor(id)
    for each, words in ((scene, "this scene"), (other, "the other scene")):
        if each.moves_per_frame:
            raise InputError(f"the street of {words} moves as its pictures do: nothing in it has a place")
        if (each.provenance.scale or "").startswith(_NO_METRES):
            raise InputError(
                f"the metres of {words} are not known ({each.provenance.scale}); give generate a "
                "camera height, or poses or depth in metres"
            )
    here, there = level_from_world(scene), level_from_world(other)
    turn = here[:3, :3].T @ there[:3, :3]
    later_s = (float(scene.times_s.min()) if place.at_s is None else place.at_s) - actor.track.first_s
    track = _laid(scene, other, actor.track, place, later_s)
    motion, new = (scene.deformation or _nothing(scene, track)).adopted(track)
    gaussians = _taken(other, actor, turn, later_s, _gain(scene, other))
    gaussians = replace(gaussians, actor=torch.full((len(gaussians),), new, dtype=torch.int64))
    box = None if actor.box is None else ActorBox(actor.box.size_m, turn @ actor.box.ahead)
    named = Actor(new, f"actor {new}", actor.kind, len(gaussians), track, box, None, actor.completed)
    return scene.inserted(named, gaussians, motion)


def _laid(scene: Scene, other: Scene, track: Track, place: SetPlace, later_s: float) -> Track:
    """The track on the road of the scene, as high above it as above the one it was on."""
    here, there = level_from_world(scene), level_from_world(other)
    points = track.positions_m @ there[:3, :3].T + there[:3, 3]
    above_m = points[:, 2] - _road_m(other, there, points[:, :2])
    flat = points[:, :2] - points[0, :2] + (place.ahead_m, place.left_m)
    level = np.column_stack([flat, _road_m(scene, here, flat) + above_m])
    return Track(track.times_s + later_s, (level - here[:3, 3]) @ here[:3, :3], track.yaw_rad)


def _road_m(
    scene: Scene, level: Float[np.ndarray, "4 4"], places: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, " n"]:
    """Height of the road at places of the level frame: below the recorded camera nearest to each."""
    path = scene.trajectory.world_from_camera[:, :3, 3] @ level[:3, :3].T + level[:3, 3]
    nearest = np.linalg.norm(places[:, None] - path[:, :2], axis=2).argmin(axis=1)
    return path[nearest, 2] - (scene.provenance.camera_height_m or 0.0)


def _nothing(scene: Scene, track: Track) -> Motion:
    """A motion of a scene in which nothing moves so far."""
    config = DeformationConfig(depth=1, width=1, position_frequencies=0, time_frequencies=0)
    end_s = max(track.last_s, track.first_s + 1e-3)
    return DeformationField(config, Domain(np.zeros(3), 1.0, track.first_s, end_s, scene.up))


@torch.no_grad()
def _taken(
    other: Scene, actor: Actor, turn: Float[np.ndarray, "3 3"], later_s: float, gain: float
) -> Gaussians:
    """The Gaussians of an actor about the middle of its bottom, at yaw 0, each as it was in its own time."""
    members = torch.nonzero(torch.as_tensor(other.dynamic.actor == actor.id)).squeeze(1)
    own = other.dynamic.without_features().select(members)
    track, up = actor.track, other.up
    middle_s = float(track.times_s[len(track.times_s) // 2])
    centres_s = torch.full((len(own),), middle_s) if own.lifespan is None else own.lifespan[:, 0]
    parts: list[Gaussians] = []
    for t_s in centres_s.clamp(track.first_s, track.last_s).unique().tolist():
        rows = own.select(centres_s.clamp(track.first_s, track.last_s) == t_s)
        at = track.at(np.array([t_s]))
        rigid = turn @ _about(up, -float(at.yaw_rad[0]))
        moved = other.moved_at(rows, t_s)
        means = (moved.means.double().numpy() - at.positions_m[0]) @ rigid.T
        parts.append(
            replace(
                rows,
                means=torch.from_numpy(means).float(),
                quaternions=multiply_quaternions(_quaternion(rigid).expand(len(rows), 4), moved.quaternions),
                log_scales=moved.log_scales,
                sh=_turned(rows.sh, rigid, gain),
            )
        )
    made = Gaussians.concatenate(*parts) if parts else own
    if made.lifespan is None:
        return made
    return replace(made, lifespan=made.lifespan + torch.tensor([later_s, 0.0]))


def _turned(sh: Float[Tensor, "n k 3"], rotation: Float[np.ndarray, "3 3"], gain: float) -> Tensor:
    """Colours times a gain, seen from turned directions; bands beyond the first are left out."""
    made = gain * sh
    made[:, 0] += (gain - 1) * 0.5 / SH_C0
    if sh.shape[1] > 1:
        # The first band is -y, z, -x of a vector.
        signs, order = made.new_tensor([-1.0, 1.0, -1.0])[:, None], [2, 0, 1]
        vector = (signs * made[:, 1:4])[:, order]
        turned = torch.einsum("ij,njc->nic", torch.from_numpy(rotation).to(sh), vector)
        made[:, 1:4] = signs * turned[:, [1, 2, 0]]
        made[:, 4:] = 0
    return made


def _gain(scene: Scene, other: Scene) -> float:
    """How much brighter the road here is than there, within bounds; 1 where one of them shows too little."""
    here, there = _of_road(scene), _of_road(other)
    if here is None or there is None:
        return 1.0
    return float(np.clip(here / max(there, 1e-3), 1 / _MOST_GAIN, _MOST_GAIN))


def _of_road(scene: Scene) -> float | None:
    """Median brightness of the road near the path."""
    level = level_from_world(scene)
    points = scene.static.means.double().numpy() @ level[:3, :3].T + level[:3, 3]
    road = (np.abs(points[:, 2]) < _ROAD_M) & (np.linalg.norm(points[:, :2], axis=1) < _NEAR_M)
    if road.sum() < _LEAST:
        return None
    colour = scene.static.sh[torch.from_numpy(np.flatnonzero(road)), 0] * SH_C0 + 0.5
    return float(colour.clamp(min=0).mean(dim=1).median())


def _about(up: Float[np.ndarray, "3"], angle_rad: float) -> Float[np.ndarray, "3 3"]:
    """A right-handed rotation about an axis."""
    x, y, z = up
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * cross @ cross


def _quaternion(rotation: Float[np.ndarray, "3 3"]) -> Float[Tensor, "1 4"]:
    """The same, wxyz."""
    return torch.from_numpy(Rotation.from_matrix(rotation).as_quat(scalar_first=True)).float()[None]
