"""Runs killed at random moments: does the same command, given again, make what an undisturbed run makes?

One run is left alone; its time is the range that the moments are drawn from. Each of the others is killed
(SIGKILL) at its moment, in the prior, the geometry, the fits, or while results are put in place, and the
same command is given again. What is compared are all files of scene, videos and held-out frames.
"""

import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.places import DREAMDRIVE
from dreamdrive_bench.common.report import as_json, write

SMALL = ["--prior", "street-world", "--frames", "0:12", "--size", "128x80"]
SMALL += ["--quality", "draft", "--hold-out", "4"]
COMPARED = ("scene", "video", "held_out")


@dataclass(frozen=True)
class Kill:
    """A run that was killed.

    Attributes:
        moment_s: When, from its start.
        after: The last stage that had ended by then; ``"start"`` before the first.
        different: Files that differ from those of the undisturbed run.
    """

    moment_s: float
    after: str
    different: tuple[str, ...]


def start(out: Path, arguments: list[str]) -> "subprocess.Popen[str]":
    """A run in a process of its own."""
    command = [*DREAMDRIVE, "generate", *arguments, "-o", str(out)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def finish(out: Path, arguments: list[str]) -> float:
    """Run to the end; the seconds it took."""
    begun = time.perf_counter()
    process = start(out, arguments)
    said = process.communicate()[0]
    if process.returncode != 0:
        raise SystemExit(f"a run failed with {process.returncode}: {said}")
    return time.perf_counter() - begun


def results(out: Path) -> dict[str, bytes]:
    """Everything that has to be the same."""
    files = (path for name in COMPARED for path in sorted((out / name).rglob("*")))
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files if path.is_file()}


def killed(out: Path, arguments: list[str], moment_s: float) -> str:
    """Kill a run at a moment; the last stage that had ended."""
    process = start(out, arguments)
    time.sleep(moment_s)
    process.send_signal(signal.SIGKILL)
    lines = process.communicate()[0].splitlines()
    ended = [line.split(":")[0] for line in lines if line.endswith(" s") and ": " in line]
    return ended[-1] if ended else "start"


def compare(whole: dict[str, bytes], out: Path) -> tuple[str, ...]:
    """Names of the files that are missing, more, or differ."""
    made = results(out)
    return tuple(sorted(name for name in whole.keys() | made.keys() if whole.get(name) != made.get(name)))


def measure(folder: Path, arguments: list[str], times: int, seed: int) -> list[Kill]:
    """Kill runs at random moments and finish them.

    Args:
        folder: Where the runs write.
        arguments: Of ``generate``, without the output folder.
        times: How many runs are killed.
        seed: Of the moments.
    """
    seconds = finish(folder / "whole", arguments)
    whole = results(folder / "whole")
    kills: list[Kill] = []
    for moment_s in np.sort(np.random.default_rng(seed).uniform(0, seconds, times)).tolist():
        out = folder / "killed"
        after = killed(out, arguments, moment_s)
        finish(out, arguments)
        kills.append(Kill(round(moment_s, 2), after, compare(whole, out)))
        found = ", ".join(kills[-1].different) or "same bytes"
        print(f"killed at {moment_s:6.2f} of {seconds:.2f} s, after {after}: {found}", flush=True)
        shutil.rmtree(out)
    return kills


def main() -> None:
    """Measure and say."""
    parser = parser_of(__doc__)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("arguments", nargs="*", default=SMALL)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        kills = measure(Path(folder), given.arguments, given.times, given.seed)
    same = sum(not kill.different for kill in kills)
    print(f"{same} of {len(kills)} resumed runs are an undisturbed one, byte for byte")
    values = {"arguments": given.arguments, "kills": [asdict(kill) for kill in kills]}
    write(given.json, as_json(values))
    sys.exit(same != len(kills))
