"""What generated samples are worth to a network that segments the street from above (the paper's Table II).

    python benchmarks/perception.py [--runs DIR] [--only streets|scenes|sets|networks] [--json FILE]

Streets, sizes, arms, regime and seeds stand in perception/protocol.json. A family of drawn streets stands for
real ones: six cameras, noise. Of all training streets 4D scenes are made from their recorded pictures, with
the weights of the street network that have seen no street of that edition; samples are rendered along new
paths. Arms: all training streets as recorded (oracle), few of them (real), these with rendered samples
(generated), with as many pictures that were warped without a scene (warped), and rendered samples of all
streets alone (only). All networks are tested on streets that nothing was made of. Everything is kept and
goes on where it was stopped.
"""

import sys
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from common.machine import describe_machine
from common.options import parser_of
from common.report import publish
from common.twin import TWIN
from dreamdrive.perception import (
    QUICK,
    SMALL,
    BevSet,
    CvtOptions,
    CvtTraining,
    Regime,
    Samples,
    ScheduleOptions,
    load_cvt,
    score,
    train_on,
)
from perception.making import make_scene, make_sets, make_street
from perception.protocol import Places, Protocol, read_protocol
from perception.tables import tables

_NETWORKS: dict[str, CvtOptions] = {"quick": QUICK, "small": SMALL}
_STEPS = ("streets", "scenes", "sets", "networks")


def main(doc: str | None) -> int:
    """Make what is missing, train, test, print the tables."""
    parser = parser_of(doc, runs="runs/perception", markdown=True)
    parser.add_argument("--only", choices=_STEPS)
    parser.add_argument("--protocol", type=Path)
    args = parser.parse_args()
    protocol = read_protocol() if args.protocol is None else read_protocol(args.protocol)
    places, network = Places(args.runs), _NETWORKS[protocol.network]
    training, validation = (protocol.streets.seeds(split) for split in ("training", "validation"))
    tested = validation[: protocol.generated.validation_streets]
    if args.only in (None, "streets"):
        _each("street", [*training, *validation], lambda seed: make_street(seed, protocol, places))
    if args.only in (None, "scenes"):
        _each("scene", [*training, *tested], lambda seed: make_scene(seed, protocol, places))
    if args.only in (None, "sets"):
        make_sets(protocol, places, network)
    if args.only not in (None, "networks"):
        return 0
    rows = [_trial(arm, seed, protocol, places, network) for seed in protocol.seeds for arm in protocol.arms]
    report = {"machine": describe_machine(), "trials": rows}
    return publish(args, report, tables(rows, protocol), ())


def _each(what: str, seeds: list[int], make: Callable[[int], None]) -> None:
    for number, seed in enumerate(seeds):
        make(seed)
        print(f"{what} {seed}: {number + 1} of {len(seeds)}", flush=True)


def _trial(arm: str, seed: int, protocol: Protocol, places: Places, network: CvtOptions) -> dict[str, Any]:
    """Train a network of an arm, or take the one that is there, and count its cells street by street."""
    r = protocol.regime
    training = CvtTraining(
        schedule=ScheduleOptions(steps=r.steps, rate=r.rate),
        low_precision=r.low_precision,
        replicas=r.replicas,
        frozen_layers=r.frozen_layers,
        seed=seed,
    )
    sets = [BevSet.open(places.set(name)) for name in protocol.arms[arm]]
    regime = Regime(network, training, r.batch, TWIN)
    weights = train_on(sets, places.network(arm, seed), regime)
    assert weights is not None
    trained = load_cvt(weights)
    row: dict[str, Any] = {"arm": arm, "seed": seed, "samples": sum(map(len, sets))}
    of = ["validation", *([protocol.realism.tested] if arm == protocol.realism.trained else [])]
    for name in of:
        by_drive = score(trained, Samples([BevSet.open(places.set(name))]))
        row[name] = {
            street: {what: asdict(at_one_half(counts)) for what, counts in found.items()}
            for street, found in by_drive.items()
        }
    print(arm, seed, "is tested", flush=True)
    return row


def at_one_half(counts: Any) -> Any:
    """Counts at a probability of one half alone, which is what is published."""
    at = counts.thresholds.index(0.5)
    one = {name: (getattr(counts, name)[at],) for name in ("hits", "false_alarms", "misses")}
    return replace(counts, thresholds=(0.5,), **one)


if __name__ == "__main__":
    sys.exit(main(__doc__))
