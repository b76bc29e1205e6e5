"""A drive of a data set: what it holds, and a scene made with its own poses and calibration.

    python examples/11_data_set.py [FOLDER] [--out DIR]

A folder of nuScenes, PandaSet or KITTI is known by what lies in it. Whatever the data set, a drive is a
`Log`: cameras with the pose of each picture, boxes on tracks, lidar and map. Boxes, lidar and map take no
part in making a scene; they are for measuring and for labels.

Without a folder a drawn street is written in the format of nuScenes and read back. A third of a minute on
two cores.
"""

import argparse
from pathlib import Path

from small import small_drive

from dreamdrive import Control, generate
from dreamdrive.data.input import dataset_of


def main() -> None:
    """List the drives of a data set, and make a scene of the first one."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("folder", nargs="?", type=Path)
    arguments.add_argument("--out", type=Path, default=Path("out/11_data_set"))
    given = arguments.parse_args()

    folder = given.folder or small_drive(given.out.parent)
    found = dataset_of(None, folder)
    if found.logs is None:
        raise SystemExit(f"{folder}: {found.about}, which has no drives with labels")
    for name in found.logs.names(folder):
        log = found.logs.read(folder, name)
        cameras = ", ".join(camera.name for camera in log.cameras)
        print(f"{found.name}: {name}, {len(log.boxes)} road users, cameras {cameras}")

    control = Control(folder, scene="0", frames="0:12:1", size=(160, 96), hold_out=4)
    outcome = generate(control, given.out, quality="draft")
    print(f"{outcome.held_out} held-out frames are predicted with {outcome.psnr:.1f} dB")


if __name__ == "__main__":
    main()
