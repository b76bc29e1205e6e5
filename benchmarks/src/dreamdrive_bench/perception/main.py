"""What generated samples are worth to a network that segments the street from above (the paper's Table II).

Streets, sizes, arms, regime and seeds stand in protocol.json. A family of drawn streets stands for
real ones: six cameras, noise. Of all training streets 4D scenes are made from their recorded pictures, with
the weights of the street network that have seen no street of that edition; samples are rendered along new
paths. Arms: all training streets as recorded (oracle), few of them (real), these with rendered samples
(generated), with as many pictures that were warped without a scene (warped), and rendered samples of all
streets alone (only). All networks are tested on streets that nothing was made of. Everything is kept and
goes on where it was stopped. Networks are trained on a core each, ``--workers`` at a time, or with ``--cuda``
eight together on a GPU.
"""

from collections.abc import Callable
from pathlib import Path

from dreamdrive.tasks.perception import QUICK
from dreamdrive_bench.common.keep import load
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.perception.making import make_scene, make_sets, make_street
from dreamdrive_bench.perception.picture import picture
from dreamdrive_bench.perception.protocol import PROTOCOL, Places, read_protocol
from dreamdrive_bench.perception.tables import published, tables
from dreamdrive_bench.perception.trials import Trial, train_and_test

_SHOWN = 11
"""Of the training streets the one in the picture."""
_STEPS = ("streets", "scenes", "sets", "networks")


def main() -> int:
    """Make what is missing, train, test, print the tables."""
    parser = parser_of(__doc__, runs="runs/perception", markdown=True)
    parser.add_argument("--only", choices=_STEPS)
    parser.add_argument("--protocol", type=Path, default=PROTOCOL)
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="networks side by side")
    parser.add_argument("--cuda", action="store_true")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="samples of one street as PNG or JPEG")
    args = parser.parse_args()
    protocol = read_protocol(args.protocol)
    places = Places(args.runs)
    training, validation = protocol.used, protocol.streets.seeds("validation")
    tested = validation[: protocol.generated.validation_streets]
    if args.only in (None, "streets"):
        _each("street", [*training, *validation], lambda seed: make_street(seed, protocol, places))
    if args.only in (None, "scenes"):
        _each("scene", [*training, *tested], lambda seed: make_scene(seed, protocol, places))
    if args.only in (None, "sets"):
        make_sets(protocol, places, QUICK, protocol.sets)
    if args.picture:
        picture(args.picture, places, training[_SHOWN])
    if args.only not in (None, "networks"):
        return 0
    trials = [Trial(arm, seed, args.runs, protocol) for seed in protocol.seeds for arm in protocol.arms]
    failed = train_and_test([each for each in trials if not each.is_done()], args.workers, cuda=args.cuda)
    rows = [row for each in trials if (row := load(each.result)) is not None]
    report = {"machine": describe_machine(), "trials": [published(row) for row in rows]}
    return publish(args, report, tables(rows, protocol), failed)


def _each(what: str, seeds: list[int], make: Callable[[int], None]) -> None:
    for number, seed in enumerate(seeds):
        make(seed)
        print(f"{what} {seed}: {number + 1} of {len(seeds)}", flush=True)
