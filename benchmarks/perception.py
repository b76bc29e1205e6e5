"""What generated samples are worth to a network that segments the street from above (the paper's Table II).

    python benchmarks/perception.py [--runs DIR] [--only streets|scenes|sets|networks] [--cuda] [--json FILE]

Streets, sizes, arms, regime and seeds stand in perception/protocol.json. A family of drawn streets stands for
real ones: six cameras, noise. Of all training streets 4D scenes are made from their recorded pictures, with
the weights of the street network that have seen no street of that edition; samples are rendered along new
paths. Arms: all training streets as recorded (oracle), few of them (real), these with rendered samples
(generated), with as many pictures that were warped without a scene (warped), and rendered samples of all
streets alone (only). All networks are tested on streets that nothing was made of. Everything is kept and
goes on where it was stopped; with ``--cuda`` all networks are trained at once on a GPU, and not kept.
"""

import sys
from collections.abc import Callable
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

import torch

from common.machine import describe_machine
from common.options import parser_of
from common.report import publish
from common.twin import TWIN
from dreamdrive.device import CPU
from dreamdrive.perception import (
    QUICK,
    SMALL,
    BevSet,
    CrossViewTransformer,
    CvtOptions,
    Samples,
    load_cvt,
    score,
    train_on,
)
from perception.making import make_scene, make_sets, make_street
from perception.protocol import Places, Protocol, read_protocol
from perception.tables import tables
from perception.together import Student, held, train_together

_NETWORKS: dict[str, CvtOptions] = {"quick": QUICK, "small": SMALL}
_STEPS = ("streets", "scenes", "sets", "networks")


def main(doc: str | None) -> int:
    """Make what is missing, train, test, print the tables."""
    parser = parser_of(doc, runs="runs/perception", markdown=True)
    parser.add_argument("--only", choices=_STEPS)
    parser.add_argument("--protocol", type=Path)
    parser.add_argument("--cuda", action="store_true")
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
    make = _on_gpu if args.cuda else _on_cpu
    rows = make(protocol, places, network)
    gpu = {"gpu": torch.cuda.get_device_name()} if args.cuda else {}
    report = {"machine": describe_machine() | gpu, "trials": rows}
    return publish(args, report, tables(rows, protocol), ())


def _each(what: str, seeds: list[int], make: Callable[[int], None]) -> None:
    for number, seed in enumerate(seeds):
        make(seed)
        print(f"{what} {seed}: {number + 1} of {len(seeds)}", flush=True)


def _on_cpu(protocol: Protocol, places: Places, network: CvtOptions) -> list[dict[str, Any]]:
    """Train a network after the other, or take those that are there, and count their cells."""
    rows, tests = list[dict[str, Any]](), _tests(protocol, places)
    for seed, arm in product(protocol.seeds, protocol.arms):
        regime = protocol.regime_of(seed, network, TWIN)
        sets = [BevSet.open(places.set(name)) for name in protocol.arms[arm]]
        weights = train_on(sets, places.network(arm, seed), regime)
        assert weights is not None
        rows.append(_tested(arm, seed, load_cvt(weights), protocol, places, tests, CPU))
    return rows


def _on_gpu(protocol: Protocol, places: Places, network: CvtOptions) -> list[dict[str, Any]]:
    """Train all networks at the same time, and count their cells."""
    device, students = torch.device("cuda"), dict[tuple[int, str], Student]()
    for arm, names in protocol.arms.items():
        samples = Samples([BevSet.open(places.set(name)) for name in names])
        regimes = {seed: protocol.regime_of(seed, network, TWIN) for seed in protocol.seeds}
        on_device = held(samples, regimes[protocol.seeds[0]], device)
        students |= {(seed, arm): Student(on_device, regime) for seed, regime in regimes.items()}
    for done in train_together(list(students.values())):
        print(f"{len(students)} networks: {done} of {protocol.regime.steps} steps", flush=True)
    tests = _tests(protocol, places)
    return [
        _tested(arm, seed, students[seed, arm].network, protocol, places, tests, device)
        for seed, arm in product(protocol.seeds, protocol.arms)
    ]


def _tests(protocol: Protocol, places: Places) -> dict[str, Samples]:
    """What networks are tested on."""
    names = "validation", protocol.realism.tested
    return {name: Samples([BevSet.open(places.set(name))]) for name in names}


def _tested(
    arm: str,
    seed: int,
    trained: CrossViewTransformer,
    protocol: Protocol,
    places: Places,
    tests: dict[str, Samples],
    device: torch.device,
) -> dict[str, Any]:
    """Counts of cells street by street."""
    own = sum(len(BevSet.open(places.set(name))) for name in set(protocol.arms[arm]))
    row: dict[str, Any] = {"arm": arm, "seed": seed, "samples": own}
    of = ["validation", *([protocol.realism.tested] if arm == protocol.realism.trained else [])]
    for name in of:
        by_drive = score(trained, tests[name], device=device, at_once=1 if device.type == "cpu" else 16)
        row[name] = {
            street: {what: asdict(counts) for what, counts in found.items()}
            for street, found in by_drive.items()
        }
    print(arm, seed, "is tested", flush=True)
    return row


if __name__ == "__main__":
    sys.exit(main(__doc__))
