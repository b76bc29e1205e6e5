"""Tries readers with many mutated files, or one case again."""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from tests.mutation.readers import READERS
from tests.mutation.runner import Case, Outcome, cases, run, tried

_CHUNK = 250


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000, help="over all readers")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reader", choices=sorted(READERS), action="append", help="only these")
    parser.add_argument("--case", type=int, help="only this one, with its traceback")
    parser.add_argument("--show", type=int, default=3, help="failures to show of each reader")
    given = parser.parse_args()
    names = given.reader or list(READERS)
    if given.case is not None:
        return _again(Case(names[0], given.case, given.seed))
    wanted = cases(names, -(-given.cases // len(names)), given.seed)
    # Cases of one reader are one after the other, so that a process writes few samples.
    parts = [wanted[i : i + _CHUNK] for i in range(0, len(wanted), _CHUNK)]
    with ProcessPoolExecutor(given.workers, mp_context=get_context("fork")) as pool:
        outcomes = [outcome for part in pool.map(run, parts) for outcome in part]
    _say(f"{'reader':24}   cases accepted  refused  wrong  worst s worst MB")
    for name in names:
        _summary(name, [outcome for outcome in outcomes if outcome.case.reader == name], given.show)
    return int(any(outcome.verdict == "wrong" for outcome in outcomes))


def _again(case: Case) -> int:
    with tempfile.TemporaryDirectory() as place:
        outcome = tried(case, Path(place), sys.stderr.fileno())
    _say(f"{outcome.verdict}, {outcome.seconds:.3f} s, {outcome.megabytes:.0f} MB\n{outcome}")
    return int(outcome.verdict == "wrong")


def _summary(name: str, own: Sequence[Outcome], show: int) -> None:
    count = {kind: sum(o.verdict == kind for o in own) for kind in ("accepted", "refused", "wrong")}
    seconds, megabytes = max(o.seconds for o in own), max(o.megabytes for o in own)
    _say(
        f"{name:24} {len(own):7} {count['accepted']:8} {count['refused']:8} {count['wrong']:6} "
        f"{seconds:8.3f} {megabytes:8.0f}"
    )
    for outcome in [o for o in own if o.verdict == "wrong"][:show]:
        _say(f"  {outcome}".replace("\n", "\n  "))


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
