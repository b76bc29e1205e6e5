"""Training data for perception: a scene of a labelled drive along new paths, with labels from above.

    python examples/10_perception_set.py [--out DIR]

A scene that was made of a drive of a data set keeps its link to it: boxes and map of the drive are the
labels of what is rendered. New places lie beside the recorded path and look aside; how visible a vehicle is
there is told by the depth of the rendered pictures. The same from the shell: `dreamdrive dataset make SCENE
--labels DRIVE`.

A third of a minute on two cores.
"""

import argparse
from pathlib import Path

from small import small_drive

from dreamdrive import Control, generate, load_scene
from dreamdrive.data.input import dataset_of
from dreamdrive.tasks.perception import (
    BevGrid,
    BevSet,
    ImageSize,
    PathOptions,
    draw_places,
    samples_of_scene,
    span_of,
    write_bev_set,
)


def main() -> None:
    """Make six samples and count what is labelled in them."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--out", type=Path, default=Path("out/10_perception_set"))
    out = arguments.parse_args().out

    folder, made = small_drive(out.parent), out.parent / "small_drive_scene"
    generate(Control(folder, scene="0", size=(160, 96)), made, quality="draft")
    logs = dataset_of(None, folder).logs
    log, scene = logs.read(folder, logs.names(folder)[0]), load_scene(made / "scene")

    path, image, grid = PathOptions(aside_m=1.0), ImageSize(96, 208, 21), BevGrid(104, 104)
    places, _ = draw_places(log, span_of(scene, log), 6, path, seed=0)
    samples = [each for each in samples_of_scene(scene, log, places, image, grid, path) if each is not None]
    write_bev_set(samples, out, image, grid, count=len(samples), replace=True)

    for note, sample in samples:
        cells = int(sample.labels.layers[4:].any(axis=0).sum())
        print(f"{note.id}: {note.aside_m:+.1f} m aside, {note.boxes} boxes, {cells} cells of road users")
    print(f"{len(BevSet.open(out))} samples are in {out}")


if __name__ == "__main__":
    main()
