"""The perception experiment: rendered samples are carried, streets are drawn and warped where networks learn.

Scenes and renders take hours of cores and are made before, by ``perception``. A sample is six pictures, 60 KB
as they are kept: renders that are learned from fit into a pack as WebP, all sets do not. What is drawn there
goes through the same WebP, so that no arm sees better pictures than another. Renders that are only tested on
are left out, and with them the test of recorded networks on renders.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import torch

from dreamdrive.compute.machine import available_cores, workers
from dreamdrive.errors import InputError
from dreamdrive.files.digest import digest
from dreamdrive.files.output import scratch_beside
from dreamdrive.tasks.perception import QUICK, BevSample
from dreamdrive_bench.common.keep import load
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.perception.making import make_sets, make_street
from dreamdrive_bench.perception.protocol import Places, Protocol, Realism
from dreamdrive_bench.perception.tables import published, tables
from dreamdrive_bench.perception.trials import Trial, held_by_arm, train_on_core, train_on_gpu
from dreamdrive_bench.training.limit import Limit, Pace
from dreamdrive_bench.training.packed import MOST_BYTES, as_carried, save_pack, unpack, with_packages

_CARRIED = "generated"


@dataclass(frozen=True)
class PerceptionPlan:
    """What is trained, and how many networks at once.

    Attributes:
        protocol: The experiment.
        side_by_side: Networks on a GPU: three seeds of three arms.
        found: Figures of an earlier call with the same pack, whose trials count.
    """

    protocol: Protocol
    side_by_side: int = 9
    found: Mapping[str, Any] = field(default_factory=dict[str, Any])

    @property
    def rows(self) -> list[dict[str, Any]]:
        """Counts that were found before."""
        return list(self.found.get("trials", ()))


class _TimeIsOverError(Exception):
    """Networks are not trained to their end."""


def make_pack(
    path: Path, runs: Path, protocol: Protocol, most_bytes: int = MOST_BYTES, wheels: Path | None = None
) -> tuple[int, int | None]:
    """Write the pack of sets that ``perception`` has made in ``runs``; its bytes, and the quality of WebP."""
    protocol = _without_realism(protocol)
    folders = {name: Places(runs).set(name) for name in protocol.sets if name.startswith(_CARRIED)}
    if missing := [str(folder) for folder in folders.values() if not folder.is_dir()]:
        raise InputError(f"{', '.join(missing)} is missing; `perception --only sets` makes it")
    with scratch_beside(path) as made:
        about = {"of": "perception", "samples": _drawn_as(protocol)}
        return save_pack(path, folders | with_packages(wheels, made), about, most_bytes)


def train(
    pack: Path, out: Path, device: torch.device, limit: Limit, figures: Figures, plan: PerceptionPlan
) -> bool:
    """Train from a pack within a limit the networks that are missing; whether all are there then."""
    plan = replace(plan, protocol=_without_realism(plan.protocol))
    protocol, places = plan.protocol, Places(out)
    about = unpack(pack, out / "sets")
    if about.get("samples") != _drawn_as(protocol):
        raise InputError(f"{pack} was made for other streets or samples; expected those of the protocol")
    said = {"sha256": sha256(pack.read_bytes()).hexdigest(), "webp": about["quality"]}
    if plan.found.get("pack", said) != said:
        raise InputError(
            "--found is of another pack; expected figures of networks that saw the same pictures"
        )
    figures.put("pack", said)
    _make(places, plan, about["quality"], figures, limit)
    there = {(row["arm"], row["seed"]) for row in plan.rows}
    every = [Trial(arm, seed, out, protocol) for seed in protocol.seeds for arm in protocol.arms]
    trials = [each for each in every if (each.arm, each.seed) not in there]
    _tell(figures, trials, plan)
    _train([each for each in trials if not each.is_done()], device, limit, figures, plan)
    return _tell(figures, trials, plan) == len(every)


def _make(places: Places, plan: PerceptionPlan, quality: int | None, figures: Figures, limit: Limit) -> None:
    """Draw streets and make the sets that are not carried."""
    protocol, names = plan.protocol, [name for name in plan.protocol.sets if _CARRIED not in name]
    seeds = [*protocol.used, *protocol.streets.seeds("validation")]
    with workers(min(available_cores(), len(seeds))) as pool:
        for _ in pool.map(partial(make_street, protocol=protocol, places=places), seeds):
            pass
        figures.put("made", "streets_s", limit.spent_s)
        seen = partial(_as_carried, quality=quality)
        make_sets(protocol, places, QUICK, names, each=pool.map, seen=seen)
    figures.put("made", "sets_s", limit.spent_s)


def _as_carried(sample: BevSample, quality: int | None) -> BevSample:
    """The same with pictures as a pack leaves them."""
    if quality is None:
        return sample
    seen = [as_carried(rgb, quality) for rgb in sample.pictures.transpose(0, 2, 3, 1)]
    return replace(sample, pictures=np.ascontiguousarray(np.stack(seen).transpose(0, 3, 1, 2)))


def _train(
    trials: Sequence[Trial], device: torch.device, limit: Limit, figures: Figures, plan: PerceptionPlan
) -> None:
    """Train what fits into the limit; each group is kept when it is done."""
    if device.type == "cpu":
        for each in trials:
            if limit.left_s > 0:
                train_on_core(each)
                _tell(figures, trials, plan)
        return
    samples, group_s = held_by_arm(trials, device), 0.0
    for first in range(0, len(trials), plan.side_by_side):
        group = trials[first : first + plan.side_by_side]
        if limit.left_s < group_s * len(group) / plan.side_by_side:
            return
        begin_s, pace = limit.spent_s, Pace(figures, f"group {1 + first // plan.side_by_side}")

        def said(done: int, total: int, pace: Pace = pace) -> None:
            pace(done, total)
            if limit.left_s < 0:
                raise _TimeIsOverError

        try:
            train_on_gpu(group, samples, said)
        except _TimeIsOverError:
            return
        _tell(figures, trials, plan)
        group_s = limit.spent_s - begin_s


def _tell(figures: Figures, trials: Iterable[Trial], plan: PerceptionPlan) -> int:
    """Put the counts that are there into the figures, with those of before; how many networks they are of."""
    rows = [*plan.rows, *(published(row) for each in trials if (row := load(each.result)) is not None)]
    figures.put("trials", rows)
    figures.put("tables", tables(rows, plan.protocol).splitlines())
    return len(rows)


def _without_realism(protocol: Protocol) -> Protocol:
    """The same without networks that are tested on renders."""
    realism = Realism(trained="", tested="validation")
    return msgspec.structs.replace(protocol, realism=realism)


def _drawn_as(protocol: Protocol) -> str:
    """Digest of all that samples follow from."""
    parts = (protocol.streets, protocol.real, protocol.generated)
    return digest([msgspec.to_builtins(part) for part in parts])
