"""Whether dreamdrive and nuscenes-devkit see the same in a data set.

PYTHON is that of an environment with nuscenes-devkit 1.2.0, which needs an older NumPy:
``python -m venv devkit && devkit/bin/pip install nuscenes-devkit==1.2.0``. Compared are, for all key frames
of all cameras, the corners of the boxes that a camera may see in its frame, calibration and files; and the
numbers of boxes by category. The devkit's picture of the first sample shows that it can draw our data set.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.data.table import DATASETS
from dreamdrive.datasets.nuscenes import open_tables
from dreamdrive.scene.street.log import Log
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish

_SIDE = Path(__file__).with_name("theirs.py")


def main() -> int:
    """Ask both and compare."""
    parser = parser_of(__doc__, markdown=True)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--devkit", type=Path, required=True)
    parser.add_argument("--picture", default="-")
    args = parser.parse_args()
    tables = open_tables(args.folder)
    command = [str(args.devkit), str(_SIDE), str(tables.root), tables.folder.name, args.picture]
    asked = subprocess.run(
        command, capture_output=True, text=True, check=False, env=os.environ | {"PYTHONPATH": ""}
    )
    if asked.returncode:
        print(asked.stderr, file=sys.stderr)
        return 1
    theirs = json.loads(asked.stdout)
    logs = DATASETS["nuscenes"].logs
    assert logs is not None
    ours = {name: logs.read(args.folder, name) for name in logs.names(args.folder)}
    report = {"machine": describe_machine(), "folder": args.folder.name, **_compared(ours, theirs)}
    rows = "\n".join(f"| {name} | {report[name]} |" for name in report if name not in ("machine", "folder"))
    return publish(args, report, f"| what | figure |\n| --- | --- |\n{rows}", ())


def _compared(ours: dict[str, Log], theirs: dict[str, Any]) -> dict[str, Any]:
    worst_m = worst_px = 0.0
    boxes = frames = 0
    wrong: list[str] = []
    for shot in theirs["shots"]:
        log = ours[shot["scene"]]
        camera = log.camera(shot["channel"])
        row = int(np.abs(camera.times_s - (shot["timestamp"] - log.start_us) / 1e6).argmin())
        frames += 1
        if Path(shot["file"]).resolve() != camera.files[row].resolve():
            wrong.append(shot["file"])
        worst_px = max(worst_px, float(np.abs(camera.pinhole.index_matrix - shot["k"]).max()))
        step = int(np.abs(log.times_s - camera.times_s[row]).argmin())
        pose = camera.world_from_camera[row]
        for track in log.boxes:
            if track.id in shot["boxes"]:
                at = int(np.abs(track.times_s - log.times_s[step]).argmin())
                own = (track.corners(at) - pose[:3, 3]) @ pose[:3, :3]
                worst_m = max(worst_m, _apart_m(own, np.array(shot["boxes"][track.id])))
                boxes += 1
    counts: dict[str, int] = {}
    for track in (each for log in ours.values() for each in log.boxes):
        counts[track.category] = counts.get(track.category, 0) + len(track.times_s)
    return {
        "key frames compared": frames,
        "boxes compared": boxes,
        "of them seen by the devkit": sum(len(shot["boxes"]) for shot in theirs["shots"]),
        "corners apart at most (m)": worst_m,
        "calibration apart at most (px)": worst_px,
        "files that differ": len(wrong),
        "numbers of categories are the same": counts == theirs["counts"],
    }


def _apart_m(one: np.ndarray, other: np.ndarray) -> float:
    """The largest distance of a corner to the nearest of the other box: their orders differ."""
    return float(np.linalg.norm(one[:, None] - other[None], axis=2).min(axis=1).max())
