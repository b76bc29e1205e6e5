"""What nuscenes-devkit says of a data set, as JSON; run by its own Python, which has no dreamdrive.

python theirs.py ROOT VERSION PICTURE
"""

import json
import sys

import matplotlib

matplotlib.use("Agg")

from nuscenes.nuscenes import NuScenes


def main(root: str, version: str, picture: str) -> None:
    """Poses and boxes of all key frames, numbers of categories; draws the first sample."""
    nusc = NuScenes(version=version, dataroot=root, verbose=False)
    shots = []
    for sample in nusc.sample:
        scene = nusc.get("scene", sample["scene_token"])["name"]
        for channel, token in sample["data"].items():
            if not channel.startswith("CAM"):
                continue
            data = nusc.get("sample_data", token)
            path, boxes, k = nusc.get_sample_data(token)
            shots.append(
                {
                    "scene": scene,
                    "channel": channel,
                    "timestamp": data["timestamp"],
                    "file": path,
                    "k": k.tolist(),
                    "boxes": {
                        nusc.get("sample_annotation", box.token)["instance_token"]: box.corners().T.tolist()
                        for box in boxes
                    },
                }
            )
    counts = {}
    for annotation in nusc.sample_annotation:
        counts[annotation["category_name"]] = counts.get(annotation["category_name"], 0) + 1
    if picture != "-":
        nusc.render_sample(nusc.sample[0]["token"], out_path=picture, verbose=False)
    json.dump({"shots": shots, "counts": counts}, sys.stdout)


main(*sys.argv[1:])
