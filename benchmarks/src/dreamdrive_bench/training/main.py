"""Trainings on a machine with a GPU that is lent for minutes: what is carried there, and the training itself.

``training NAME --make --pack FILE`` makes a pack here, of at most ``--most-mb``. ``training NAME --pack FILE
--runs DIR --device cuda --minutes 8 --json FILE`` trains there within that time: ``street`` the street
network, ``restorer`` what mends views, ``perception`` the networks of that experiment. Figures are in the
file as they come: how fast it goes, losses, what is judged. The same command goes on in the same ``--runs``;
``perception`` also takes the ``--found`` figures of an earlier call. All is seeded; only how many steps are
taken and streets drawn may follow from the time, and is told.
"""

# Nothing here needs the compiled core before it is there.

import argparse
import json
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dreamdrive.compute.device import computing_on
from dreamdrive.errors import InputError
from dreamdrive.files.output import temporary_folder
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.places import ROOT
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.gpu.whole import core_command, machine
from dreamdrive_bench.training.limit import Limit

if TYPE_CHECKING:
    import torch

    from dreamdrive_bench.perception.protocol import Protocol


def main() -> int:
    """Make a pack or train from one; 1 where something is left to do."""
    options = _options()
    if (
        min(options.minutes, options.most_mb) <= 0
        or min(options.batch, options.streets, options.steps or 1) < 1
    ):
        raise InputError("expected more than no minutes, megabytes, pictures, streets and steps")
    limit = Limit(60 * options.minutes)
    if options.core:
        _compile()
    if options.make:
        return _make(options)
    with computing_on(options.device) as device:
        figures = Figures(options.json or options.runs / f"{options.name}.json", device)
        figures.put("machine", machine())
        trainings = {"street": _train_street, "restorer": _train_restorer, "perception": _train_perception}
        train, done = trainings[options.name], False
        with figures.attempt(options.name):
            done = train(options, device, limit, figures)
        figures.put("seconds", limit.spent_s)
    return int(not done)


def _options() -> argparse.Namespace:
    parser = parser_of(__doc__, runs="runs/training")
    parser.add_argument("name", choices=("street", "restorer", "perception"))
    parser.add_argument("--pack", type=Path, required=True, metavar="FILE")
    parser.add_argument("--make", action="store_true", help="make the pack, train nothing")
    parser.add_argument("--most-mb", type=float, default=24.0, metavar="MB", help="that a pack may take")
    parser.add_argument("--wheels", type=Path, metavar="DIR", help="with --make: wheels that are packed")
    parser.add_argument("--device", default="cpu", metavar="cpu|cuda")
    parser.add_argument("--minutes", type=float, default=8.0, metavar="M", help="that all may take")
    parser.add_argument("--core", action="store_true", help="compile the core of this checkout before")
    parser.add_argument(
        "--sets",
        type=Path,
        metavar="DIR",
        help="with --make: the --runs of `perception`, or the pairs of `dreamdrive train restorer`",
    )
    street = parser.add_argument_group("street, restorer")
    street.add_argument("--streets", type=int, default=192, metavar="N", help="drawn to learn from, at most")
    street.add_argument("--steps", type=int, metavar="N", help="as many as fit, if not told")
    street.add_argument("--batch", type=int, default=16, metavar="N", help="pictures a step")
    street.add_argument(
        "--rate", type=float, default=1e-3, metavar="R", help="largest step of the optimiser, for street"
    )
    street.add_argument("--seed", type=int, default=0, metavar="S")
    street.add_argument(
        "--init", type=Path, metavar="FILE", help="weights to start from; the twin's if not told"
    )
    perception = parser.add_argument_group("perception")
    perception.add_argument("--protocol", type=Path, metavar="FILE", help="longer.json if not told")
    perception.add_argument("--found", type=Path, metavar="FILE", help="figures of an earlier call")
    return parser.parse_args()


def _compile() -> None:
    """Compile the core, unless it lies beside its sources already."""
    if not list((ROOT / "src/dreamdrive").glob("_native*.so")):
        with temporary_folder() as build:
            subprocess.run(core_command(build), check=True, cwd=ROOT)


def _make(options: argparse.Namespace) -> int:
    most = round(options.most_mb * 1e6)
    if options.name == "street":
        from dreamdrive_bench.training import street

        size, quality = street.make_pack(options.pack, most, options.wheels)
    elif options.sets is None:
        raise InputError("--sets is missing; expected the folder that was filled before, see --help")
    elif options.name == "restorer":
        from dreamdrive_bench.training import restorer

        size, quality = restorer.make_pack(options.pack, options.sets, most, options.wheels)
    else:
        from dreamdrive_bench.training import perception

        protocol = _protocol(options)
        size, quality = perception.make_pack(options.pack, options.sets, protocol, most, options.wheels)
    pictures = "pictures as they are" if quality is None else f"pictures as WebP of quality {quality}"
    print(f"{options.pack}: {size / 1e6:.1f} MB, {pictures}")
    return 0


def _train_street(
    options: argparse.Namespace, device: "torch.device", limit: Limit, figures: Figures
) -> bool:
    from dreamdrive_bench.training.street import StreetPlan, train

    plan = StreetPlan(streets=options.streets, steps=options.steps)
    loader = replace(plan.options.loader, batch=options.batch)
    training = replace(plan.options, rate=options.rate, seed=options.seed, loader=loader)
    plan = replace(plan, options=training, init=options.init or plan.init)
    return train(options.pack, options.runs / "street", device, limit, figures, plan)


def _train_restorer(
    options: argparse.Namespace, device: "torch.device", limit: Limit, figures: Figures
) -> bool:
    from dreamdrive_bench.training.restorer import RestorerPlan, train

    plan = RestorerPlan(steps=options.steps)
    training = replace(plan.options, seed=options.seed, batch=options.batch)
    plan = replace(plan, options=training)
    return train(options.pack, options.runs / "restorer", device, limit, figures, plan)


def _train_perception(
    options: argparse.Namespace, device: "torch.device", limit: Limit, figures: Figures
) -> bool:
    from dreamdrive_bench.training.perception import PerceptionPlan, train

    found = json.loads(options.found.read_text()) if options.found else {}
    plan = PerceptionPlan(_protocol(options), found=found)
    return train(options.pack, options.runs / "perception", device, limit, figures, plan)


def _protocol(options: argparse.Namespace) -> "Protocol":
    from dreamdrive_bench.perception.protocol import PROTOCOL, read_protocol

    return read_protocol(options.protocol or PROTOCOL.with_name("longer.json"))
