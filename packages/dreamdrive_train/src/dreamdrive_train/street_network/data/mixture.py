"""Records of several folders, and which of them a batch takes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import JSON_RAISES
from dreamdrive.files.paths import check_file
from dreamdrive_train.street_network.data.records import Record, read_records


@dataclass(frozen=True)
class Entry:
    """A record and the folder that its pictures are in."""

    folder: Path
    record: Record


@dataclass(frozen=True)
class Source:
    """Records of one source: its share in what is drawn, and the chance of each record in it."""

    share: float
    entries: tuple[Entry, ...]
    chances: Float[np.ndarray, " n"]


@dataclass(frozen=True)
class Mixture:
    """Records to train on, by sources; their shares sum to 1."""

    sources: tuple[Source, ...]

    @staticmethod
    def of(entries: Sequence[Entry], weights: Mapping[str, float]) -> "Mixture":
        """Sources by their weights, 1 where none is given, and the records of each by their own."""
        by_name: dict[str, list[Entry]] = {}
        for entry in entries:
            by_name.setdefault(entry.record.source, []).append(entry)
        if unknown := sorted(set(weights) - set(by_name)):
            raise InputError(
                f"no record is of {', '.join(unknown)}; sources are {', '.join(sorted(by_name)) or 'none'}"
            )
        total = sum(weights.get(name, 1.0) for name in by_name)
        if min(weights.values(), default=0.0) < 0 or not total > 0:
            raise InputError("nothing is drawn; expected records, and weights of which one is above 0")
        return Mixture(
            tuple(_source(by_name[name], weights.get(name, 1.0) / total) for name in sorted(by_name))
        )

    def draw(self, count: int, generator: np.random.Generator) -> list[Entry]:
        """So many entries, spread over the sources as evenly as can be, so that each batch mixes them."""
        ends = np.cumsum([source.share for source in self.sources])
        comb = (np.arange(count) + generator.random()) / count * ends[-1]
        which = np.minimum(np.searchsorted(ends, comb, side="right"), len(ends) - 1)
        chosen = [self.sources[index] for index in which]
        return [each.entries[generator.choice(len(each.entries), p=each.chances)] for each in chosen]


def _source(entries: Sequence[Entry], share: float) -> Source:
    weights = np.array([entry.record.weight for entry in entries])
    return Source(share, tuple(entries), weights / weights.sum())


def read_entries(folders: Sequence[Path]) -> list[Entry]:
    """All records of folders; InputError where a line or a picture of one cannot be used."""
    found: list[Entry] = []
    for folder in folders:
        check_file(folder / "records.jsonl")
        try:
            found += [Entry(folder, record) for record in read_records(folder)]
        except JSON_RAISES as error:
            raise InputError(f"{folder / 'records.jsonl'}: {error}; expected one record a line") from None
    return found


def split(entries: Sequence[Entry], judged: Sequence[Entry] = ()) -> tuple[list[Entry], list[Entry]]:
    """What is trained on, and what is kept out with ``judged``.

    Raises:
        InputError: Both share a recording or street.
    """
    parts = (
        [entry for entry in entries if not entry.record.kept_out],
        [*(entry for entry in entries if entry.record.kept_out), *judged],
    )
    groups = [{(each.record.source, each.record.group) for each in part} for part in parts]
    if shared := sorted(groups[0] & groups[1]):
        source, group = shared[0]
        raise InputError(
            f"{group} of {source} is kept out and trained on; expected all records of a group on one side"
        )
    return parts
