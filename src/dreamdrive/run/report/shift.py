"""The drive beside the recorded one: whether it is shown, and on which side."""

from dataclasses import dataclass

from dreamdrive.drive import room_of
from dreamdrive.run.report.facts import Facts
from dreamdrive.run.report.judge import aside_m
from dreamdrive.scene.scene import Scene


@dataclass(frozen=True)
class Shift:
    """A drive ``right_m`` to the right of the recorded one, None where there is none; ``words`` say why."""

    right_m: float | None
    words: str


def shift_of(scene: Scene, facts: Facts) -> Shift:
    """As far aside as views can be trusted, or half as far where only that is free, to the freer side."""
    reach_m = aside_m(facts)
    if not reach_m:
        return Shift(None, "there is no video from aside, as it could not be trusted")
    rooms = [(far_m, room_of(scene, far_m)) for far_m in (reach_m, reach_m / 2)]
    far_m, room = next((each for each in rooms if each[1] is not None and each[1].free), rooms[0])
    if room is None:
        words = "what is free is not known, as no road was found"
        return Shift(reach_m, f"shift.mp4 is {reach_m:g} m to the right: {words}")
    why = room.why if far_m == reach_m else f"neither side is free {reach_m:g} m away; nearer, {room.why}"
    words = f"shift.mp4 is {far_m:g} m to the {room.side}: {why}"
    return Shift(far_m if room.side == "right" else -far_m, words)
