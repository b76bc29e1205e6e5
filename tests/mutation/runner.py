"""Reads spoilt samples in a process of its own: what it raises, how long it takes, how much memory."""

import faulthandler
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from fnmatch import fnmatch
from pathlib import Path
from random import Random

from tests.mutation.mutators import mutate, remove
from tests.mutation.reader import Reader
from tests.mutation.readers import READERS

SECONDS, MEGABYTES = 5.0, 500.0
"""Most computing and memory that reading a spoilt sample may take."""
WAIT_S = 15.0
"""Longest that it may take by the clock: the machine may have other work."""
_ADDRESSES = 2_000_000_000
"""A last resort: bytes of addresses beyond what the process has, torch and all."""
_LONGEST_MESSAGE = 1000


@dataclass(frozen=True)
class Case:
    """One spoilt sample; equal cases are spoilt alike."""

    reader: str
    number: int
    seed: int


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes:
        case: Which.
        verdict: ``accepted``, ``refused`` or ``wrong``.
        seconds: How long the processor was at it.
        megabytes: By how much the memory in use grew at most.
        how: What was spoilt.
        said: The message, or what is wrong.
    """

    case: Case
    verdict: str
    seconds: float = 0.0
    megabytes: float = 0.0
    how: str = ""
    said: str = ""

    def __str__(self) -> str:
        case = self.case
        return (
            f"{case.reader} case {case.number} ({self.how}): {self.said}\n"
            f"again: python -m tests.mutation --reader {case.reader} --case {case.number} --seed {case.seed}"
        )


def cases(readers: Iterable[str], each: int, seed: int) -> list[Case]:
    """So many cases of every reader."""
    return [Case(name, number, seed) for name in readers for number in range(each)]


def run(wanted: Sequence[Case]) -> list[Outcome]:
    """Outcomes of all cases, in their order; a process that dies takes one case with it."""
    done: list[Outcome] = []
    with tempfile.TemporaryDirectory() as place:
        while len(done) < len(wanted):
            done += _in_child(wanted[len(done) :], Path(place) / str(len(done)))
    return done


def _in_child(wanted: Sequence[Case], place: Path) -> list[Outcome]:
    place.mkdir()
    log, trace = place / "log", place / "trace"
    child = os.fork()
    if child == 0:
        code = 1
        try:
            with log.open("w") as told, trace.open("w") as errors:
                _be_quiet(errors.fileno())
                for case in wanted:
                    told.write(json.dumps(asdict(tried(case, place, errors.fileno()))) + "\n")
                    told.flush()
            code = 0
        except BaseException:  # noqa: BLE001
            trace.write_text(traceback.format_exc())
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    rows = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
    done = [Outcome(**{**row, "case": Case(**row["case"])}) for row in rows]
    if len(done) < len(wanted):
        code = os.waitstatus_to_exitcode(status)
        end = signal.Signals(-code).name if code < 0 else f"exit {code}"
        words = trace.read_text(errors="replace")
        words = words[words.find("Timeout (") :][:1500] if "Timeout (" in words else words[-1500:]
        done.append(Outcome(wanted[len(done)], "wrong", said=f"the process ended ({end}): {words}"))
    return done


def _be_quiet(errors: int) -> None:
    """Libraries write of damage to the terminal; warnings are errors, as for a user they are noise."""
    os.dup2(errors, 1)
    os.dup2(errors, 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    space = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (space + _ADDRESSES, resource.RLIM_INFINITY))
    warnings.simplefilter("error")
    warnings.filterwarnings("ignore", category=DeprecationWarning)


def tried(case: Case, place: Path, errors: int | None = None) -> Outcome:
    """Spoil the sample of a reader, read it, and put the sample back.

    Args:
        case: Which.
        place: Where samples lie; they are written at their first use.
        errors: File to which a trace goes where reading takes too long; without it nothing ends that.
    """
    reader = READERS[case.reader]
    folder = place / reader.name
    sample = _sample(reader, folder)
    rng = Random(f"{case.reader} {case.number} {case.seed}")
    name = rng.choice([name for name, data in sample.items() if data and fnmatch(name, reader.spoils)])
    how = f"{name}: {mutate(folder / name, rng)}"
    path = folder / name
    mended = reader.mend is not None and path.is_file() and not path.is_symlink() and rng.random() < 0.7
    if mended and reader.mend is not None:
        # What cannot be mended any more is damaged enough.
        with suppress(Exception):
            reader.mend(folder)
    try:
        return _read(case, reader, folder, Path(name).name, how, errors)
    finally:
        for each in sample if mended else [name]:
            remove(folder / each)
            (folder / each).write_bytes(sample[each])


_samples: dict[Path, dict[str, bytes]] = {}


def _sample(reader: Reader, folder: Path) -> dict[str, bytes]:
    """The content of each file of a reader's sample, which is written and read once."""
    if folder not in _samples:
        folder.mkdir(parents=True)
        reader.write(folder)
        reader.read(folder)
        found = sorted(path for path in folder.rglob("*") if path.is_file())
        _samples[folder] = {str(path.relative_to(folder)): path.read_bytes() for path in found}
    return _samples[folder]


def _read(case: Case, reader: Reader, folder: Path, name: str, how: str, errors: int | None) -> Outcome:
    verdict, said = "accepted", ""
    begin_mb, begin_s = _resting_mb(), time.process_time()
    if errors is not None:
        faulthandler.dump_traceback_later(WAIT_S, file=errors)
        signal.setitimer(signal.ITIMER_REAL, WAIT_S + 0.5)  # nothing handles it: the process ends
    try:
        reader.read(folder)
    except reader.refusals as error:
        verdict, said = "refused", str(error)
        if "\n" in said.strip() or len(said) > _LONGEST_MESSAGE:
            verdict, said = "wrong", f"a message of {len(said)} characters: {said[:300]}"
        elif reader.names_file and str(folder) not in said and name not in said:
            verdict, said = "wrong", f"a message that names no file: {said}"
    except Exception:  # noqa: BLE001
        verdict, said = "wrong", traceback.format_exc(limit=-12)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        faulthandler.cancel_dump_traceback_later()
    seconds, megabytes = time.process_time() - begin_s, max(_peak_mb() - begin_mb, 0.0)
    if seconds > SECONDS:
        verdict, said = "wrong", f"{seconds:.1f} s of computing; then {verdict} {said[-1500:]}"
    if megabytes > MEGABYTES:
        verdict, said = "wrong", f"{megabytes:.0f} MB of memory; then {verdict} {said[-1500:]}"
    return Outcome(case, verdict, seconds, megabytes, how, said)


def _resting_mb() -> float:
    """Memory in use; what was in use most is forgotten."""
    if sys.platform != "linux":
        return 0.0
    Path("/proc/self/clear_refs").write_text("5")
    return _status_mb("VmRSS")


def _peak_mb() -> float:
    return _status_mb("VmHWM") if sys.platform == "linux" else 0.0


def _status_mb(name: str) -> float:
    text = Path("/proc/self/status").read_text()
    return int(text.split(f"{name}:")[1].split()[0]) / 1000
