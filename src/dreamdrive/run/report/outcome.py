"""The outcome of a run, from its report, and the lines that say it."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import msgspec

from dreamdrive.files.json_file import of_type, read_json

# A report may come from anywhere: what is printed of it is one line of plain characters.
_Text = Annotated[str, msgspec.Meta(max_length=1000, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
_Count = Annotated[int, msgspec.Meta(ge=0)]
_Seconds = Annotated[float, msgspec.Meta(ge=0, le=1e9)]
_NAMED = 3
_IDS = 40
_LIMITS = "metres", "aside", "drive", "shift"
_BLEND = "flow_interpolation"
PICTURE = "report.png"
"""What lies beside the report."""


class _Frames(msgspec.Struct):
    count: _Count
    size: tuple[_Count, _Count]


class _Gaussians(msgspec.Struct):
    static: _Count
    dynamic: _Count


class _Stage(msgspec.Struct):
    seconds: _Seconds


class _Actor(msgspec.Struct):
    id: _Count | None = None
    kind: _Text = "unknown"


class _Likeness(msgspec.Struct):
    psnr: float


class _Baseline(msgspec.Struct):
    mean: _Likeness | None = None


class _Report(msgspec.Struct):
    frames: _Frames
    gaussians: _Gaussians
    stages: dict[_Text, _Stage]
    seconds: _Seconds | None = None
    actors: list[_Actor] = []
    held_out: dict[str, Any] = {}
    held_out_mean: _Likeness | None = None
    baselines: dict[str, _Baseline] = {}
    rough: list[_Text] = []
    limits: list[_Text] = []
    program: _Text = ""


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes:
        already_finished: Whether the result was there before, and nothing was computed.
        frames: Number of frames.
        size: Their width and height.
        still: Gaussians of what stands.
        moving: Gaussians of what moves.
        things: Number of things that move.
        ids: Their ids, by what they are.
        seconds: What each stage took when it was computed.
        held_out: Number of held-out frames.
        psnr: Their mean likeness to what the scene shows, in decibels; None without any.
        blended_psnr: The same of blending their neighbours along the motion in the picture.
        rough: Why the result is rough and what helps, a sentence each; empty where it is not.
        notes: How sure metres are, how far beside the path views hold, how far and fast the car goes, and
            what video shows it from aside.
        program: Digest of the program that made it; empty where the report is older than these.
        whole_s: What all of it took; None where the report does not tell, and the stages alone do.
        picture: ``report.png`` beside the report; None where it was not read from a folder.
    """

    already_finished: bool
    frames: int
    size: tuple[int, int]
    still: int
    moving: int
    things: int
    seconds: dict[str, float]
    held_out: int
    psnr: float | None
    blended_psnr: float | None
    rough: tuple[str, ...]
    notes: tuple[str, ...]
    program: str = ""
    ids: dict[str, tuple[int, ...]] = field(default_factory=dict)
    whole_s: float | None = None
    picture: Path | None = None

    def _repr_html_(self) -> str:
        from dreamdrive.show import card, small_picture

        rows = dict(line.split(maxsplit=1) for line in lines_of(self))
        there = self.picture is not None and self.picture.is_file()
        return card("Outcome", rows, small_picture(self.picture) if self.picture and there else None)


def read_outcome(report: Path, *, already_finished: bool) -> Outcome:
    """The outcome that ``report.json`` tells of."""
    told = outcome_of(read_json(report), str(report), already_finished=already_finished)
    return replace(told, picture=report.parent / PICTURE)


def outcome_of(document: dict[str, Any], where: str, *, already_finished: bool) -> Outcome:
    """The outcome that a report tells of, called ``where`` in messages."""
    told = of_type(document, _Report, where)
    blend = told.baselines.get(_BLEND, _Baseline()).mean
    return Outcome(
        already_finished,
        told.frames.count,
        told.frames.size,
        told.gaussians.static,
        told.gaussians.dynamic,
        len(told.actors),
        {name: stage.seconds for name, stage in told.stages.items()},
        len(told.held_out),
        None if told.held_out_mean is None else told.held_out_mean.psnr,
        None if blend is None else blend.psnr,
        tuple(told.rough),
        tuple(told.limits),
        told.program,
        _ids(told.actors),
        told.seconds,
    )


def _ids(actors: list[_Actor]) -> dict[str, tuple[int, ...]]:
    found: dict[str, tuple[int, ...]] = {}
    for actor in actors:
        if actor.id is not None:
            found[actor.kind] = (*found.get(actor.kind, ()), actor.id)
    return found


def lines_of(outcome: Outcome) -> tuple[str, ...]:
    """Lines that say how a run went, each with a first word that tells of what."""
    lines = [("made", _made(outcome))]
    if outcome.ids:
        lines.append(("moving", _moving(outcome.ids)))
    if outcome.psnr is not None and outcome.blended_psnr is not None:
        lines.append(("checked", _checked(outcome.held_out, outcome.psnr, outcome.blended_psnr)))
    if outcome.rough:
        lines.append(("rough", f"because {'. Also, '.join(outcome.rough)}."))
    lines += [(word, f"{note}.") for word, note in zip(_LIMITS, outcome.notes, strict=False)]
    return tuple(f"{word:<7} {text}" for word, text in lines)


def _made(outcome: Outcome) -> str:
    width, height = outcome.size
    things = {0: "nothing that moves", 1: "1 moving thing"}.get(
        outcome.things, f"{outcome.things} moving things"
    )
    if outcome.moving and not outcome.things:
        things = "parts that move and have no track" if outcome.still else "all of it free to move"
    blobs = outcome.still + outcome.moving
    return (
        f"a scene of {blobs:,} Gaussians with {things}, from {outcome.frames} frames of {width}x{height}, in "
        f"{_took(outcome.seconds, outcome.whole_s)}"
    )


def _moving(ids: dict[str, tuple[int, ...]]) -> str:
    """The ids of what moves, as ``render --without`` takes them."""
    left, parts = _IDS, list[str]()
    for kind, numbers in ids.items():
        shown, left = numbers[:left], left - len(numbers[:left])
        parts += [f"{kind} {' '.join(map(str, shown))}"] if shown else []
    hidden = sum(map(len, ids.values())) - (_IDS - left)
    more = f", and {hidden} more in report.json" if hidden else ""
    return f"{', '.join(parts)}{more}: render --without ID leaves one out"


def _took(seconds: dict[str, float], whole_s: float | None) -> str:
    """The whole and the longest stages."""
    longest = sorted(seconds.items(), key=lambda stage: -stage[1])[:_NAMED]
    parts = [f"{name} {duration(spent)}" for name, spent in longest if spent >= 1]
    whole_s = sum(seconds.values()) if whole_s is None else whole_s
    rest = whole_s - sum(spent for _, spent in longest if spent >= 1)
    if parts and rest >= 1:
        parts.append(f"the rest {duration(rest)}")
    return duration(whole_s) + (f" ({', '.join(parts)})" if parts else "")


def duration(seconds: float) -> str:
    """A time for people: ``8 s``, ``2 min 5 s``, ``1 h 20 min``."""
    whole = max(1, round(seconds))
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min" + (f" {whole % 60} s" if whole % 60 else "")
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def _checked(held_out: int, psnr: float, blended: float) -> str:
    what = "1 held-out frame is" if held_out == 1 else f"{held_out} held-out frames are"
    return (
        f"{what} predicted with {psnr:.1f} dB; blending the frames beside gives {blended:.1f} dB (more is "
        "better)"
    )
