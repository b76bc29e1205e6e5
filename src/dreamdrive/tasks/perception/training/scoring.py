"""Scoring of a network on a set of samples, all of it and drive by drive."""

from collections import defaultdict
from itertools import groupby

import torch

from dreamdrive.compute.device import CPU
from dreamdrive.progress import Progress, silent
from dreamdrive.tasks.perception.network.inputs import as_batch
from dreamdrive.tasks.perception.network.network import CrossViewTransformer
from dreamdrive.tasks.perception.training.metric import IouCounts, bev_counts
from dreamdrive.tasks.perception.training.sampling import Samples

Counts = dict[str, IouCounts]
"""By ``vehicle``, ``vehicle_all`` and ``road``, see ``metric.bev_counts``."""


@torch.no_grad()
def score(
    network: CrossViewTransformer,
    samples: Samples,
    *,
    device: torch.device = CPU,
    at_once: int = 1,
    progress: Progress = silent,
) -> dict[str, Counts]:
    """Counts of cells by drive; added up they are those of the whole set, as published figures are.

    Args:
        network: In its place; it is moved to the device and left there.
        samples: To segment; those of a drive stand together.
        device: Where.
        at_once: Most samples of a drive in one batch; all have as many cameras.
        progress: Told of samples done.
    """
    network.to(device).eval()
    found: dict[str, Counts] = defaultdict(dict)
    done = 0
    for scene, group in groupby(range(len(samples)), samples.scene):
        rows, drive = list(group), found[scene]
        for first in range(0, len(rows), at_once):
            some = rows[first : first + at_once]
            batch = as_batch([samples[index] for index in some]).to(device)
            said = network(batch.pictures, batch.pixel_from_camera, batch.camera_from_ego)
            for name, counts in bev_counts(said, batch.truth).items():
                drive[name] = drive[name] + counts if name in drive else counts
            done += len(some)
            progress(done, len(samples))
    return dict(found)


def pooled(by_drive: dict[str, Counts]) -> Counts:
    """Counts of all drives together."""
    total: Counts = {}
    for counts in by_drive.values():
        for name, each in counts.items():
            total[name] = total[name] + each if name in total else each
    return total
