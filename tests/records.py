"""Folders of records of drawn streets, small and with all truth."""

from pathlib import Path

import cv2
import numpy as np

from dreamdrive.scene.street.street_class import ROAD_USERS, StreetClass
from dreamdrive.scene.street.truth import DriveTruth, Semantic
from dreamdrive_train.street_network.data.records import Record, depth_steps, write_records
from streetworld import make_street

CLASSES = {
    Semantic.SKY: StreetClass.SKY,
    Semantic.ROAD: StreetClass.ROAD,
    Semantic.MARKING: StreetClass.MARKING,
    Semantic.SIDEWALK: StreetClass.GROUND,
    Semantic.GRASS: StreetClass.GROUND,
    Semantic.BUILDING: StreetClass.STRUCTURE,
    Semantic.VEGETATION: StreetClass.VEGETATION,
    Semantic.POLE: StreetClass.POLE,
    Semantic.SIGN: StreetClass.POLE,
    Semantic.CAR: StreetClass.VEHICLE,
    Semantic.VAN: StreetClass.VEHICLE,
    Semantic.TRUCK: StreetClass.VEHICLE,
    Semantic.BICYCLE: StreetClass.TWO_WHEELER,
    Semantic.PEDESTRIAN: StreetClass.PERSON,
}
HEIGHT_M = 1.5


def write_folder(
    folder: Path, seeds: range, *, frames: int = 2, size: tuple[int, int] = (128, 80), kept_out: int = 0
) -> list[Record]:
    """Draw streets and write their records; those of the last seeds are kept out."""
    folder.mkdir(parents=True)
    records: list[Record] = []
    for seed in seeds:
        drive = make_street(seed, frames, 1.0, size, camera_height_m=HEIGHT_M)
        records += [
            _write(drive, k, folder, f"{seed}-{k}", str(seed), seed >= seeds.stop - kept_out)
            for k in range(frames)
        ]
    write_records(records, folder)
    return records


def write_bare(folder: Path, source: str = "real") -> list[Record]:
    """Two real-looking pictures of which nothing is known."""
    folder.mkdir(parents=True)
    noise = np.random.default_rng(0).integers(0, 255, (2, 5, 8, 3), np.uint8)
    for k, each in enumerate(noise):
        cv2.imwrite(str(folder / f"{k}.png"), cv2.resize(each, (128, 80)))
    records = [Record(image=f"{k}.png", source=source, group=str(k)) for k in range(len(noise))]
    write_records(records, folder)
    return records


def _write(drive: DriveTruth, k: int, folder: Path, name: str, group: str, kept_out: bool) -> Record:
    table = np.array([CLASSES.get(Semantic(each), StreetClass.STRUCTURE) for each in range(len(Semantic))])
    classes = table[drive.semantic[k]].astype(np.uint8)
    instances = np.where(np.isin(classes, ROAD_USERS), drive.instance[k], 0).astype(np.uint8)
    labels = np.stack([np.zeros_like(classes), instances, classes], axis=2)
    for end, picture in (
        ("", drive.frames[k][..., ::-1]),
        ("-labels", labels),
        ("-depth", depth_steps(drive.depth_m[k])),
    ):
        cv2.imwrite(str(folder / f"{name}{end}.png"), picture)
    camera = drive.cameras[k]
    up = drive.ground.seen_from(camera.world_from_camera).normal_world
    return Record(
        image=f"{name}.png",
        source="drawn",
        group=group,
        labels=f"{name}-labels.png",
        depth=f"{name}-depth.png",
        focal_px=camera.fx_px,
        horizon_px=float(-camera.fy_px * up[2] / up[1]),
        roll_rad=float(np.arctan2(-up[0], -up[1])),
        camera_height_m=HEIGHT_M,
        distorted=False,
        metric=True,
        kept_out=kept_out,
    )
