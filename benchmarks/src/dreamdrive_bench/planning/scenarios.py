"""Instants of planning in drawn streets, with or without a conflict ahead.

A scenario is a street of the first edition with some more road users, who come into conflict with the ego if
it goes on as it does. Kinds, seeds and sizes stand in protocol.json. The frames up to the instant
are what a scene is made of; what all do after it is what plans are judged by. The true ego brakes or swerves
in time. The others do not react. The picture shows the first four scenarios of each kind from above: green
the true ego, red the ego if it went straight on, brown who is in conflict with it, at every second.
"""

import argparse
from pathlib import Path

import numpy as np

from dreamdrive.scene.street.layout import track_function
from dreamdrive.show import write_png
from dreamdrive_bench.planning.conflicts import CONFLICTS, Stage
from dreamdrive_bench.planning.driver import STEP_S
from dreamdrive_bench.planning.ego import EgoWay
from dreamdrive_bench.planning.footprints import FRONT_M, reference_poses
from dreamdrive_bench.planning.picture import draw_grid
from dreamdrive_bench.planning.playing import Played, play
from dreamdrive_bench.planning.protocol import KINDS, Kind, Protocol, read_protocol
from dreamdrive_bench.planning.scenario import Scenario
from dreamdrive_bench.planning.streets import Street, street_of
from streetworld import StreetOptions, draw_street

_STREETS, _TRIES = 200, 25
_LANE_BEHIND_M, _LANE_AHEAD_M = 10.0, 70.0
_EACH = 4  # of a kind, in the picture


def draw_scenario(kind: Kind, seed: int, protocol: Protocol | None = None) -> Scenario:
    """The scenario of a kind and a seed; equal ones are equal.

    Streets and road users are drawn until nobody collides, the true ego drives comfortably, and the foremost
    road user of the conflict is in view.

    Args:
        kind: What happens ahead.
        seed: At least 0.
        protocol: Times and sizes; None takes the committed one.

    Raises:
        RuntimeError: Nothing fits; it is not known to happen.
    """
    protocol = read_protocol() if protocol is None else protocol
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    for number in range(_STREETS):
        speed = float(rng.uniform(6.0, 10.5))
        options = StreetOptions(protocol.end_s, speed, edition=protocol.edition)
        street = street_of(draw_street(1000 * seed + number, options))
        for _ in range(_TRIES):
            stage = Stage(rng, street, _ego(rng, kind, street, speed, protocol), protocol)
            conflict = CONFLICTS[kind](stage)
            played = None if conflict is None else play(stage, conflict)
            if played is not None:
                return _scenario(kind, seed, played, protocol)
    raise RuntimeError(f"no street of {_STREETS} fits the scenario {kind}-{seed}")


def _ego(
    rng: np.random.Generator, kind: Kind, street: Street, speed_m_s: float, protocol: Protocol
) -> EgoWay:
    """In the rightmost lane; where a road crosses it comes to the junction within the horizon."""
    start = float(rng.uniform(-20.0, 2.0))
    if kind == "crossing" and street.crossing_m is not None and street.other is not None:
        wide = street.other.half_m
        arrives = protocol.instant_s + float(rng.uniform(1.4, 2.8))
        start = street.crossing_m + float(rng.uniform(-wide, wide)) - FRONT_M - speed_m_s * arrives
    return EgoWay(
        road=street.main,
        lane_left_m=street.lane_left_m,
        start_m=start,
        speed_m_s=speed_m_s,
        change_m_s2=float(rng.uniform(-0.2, 0.2)),
        instant_s=protocol.instant_s,
        phase_rad=float(rng.uniform(0, 2 * np.pi)),
    )


def _scenario(kind: Kind, seed: int, played: Played, protocol: Protocol) -> Scenario:
    way, layout = played.way, played.layout
    stations = way.now_m + np.arange(-_LANE_BEHIND_M, _LANE_AHEAD_M + 1)
    count = round((protocol.end_s - protocol.instant_s) / STEP_S) + 1
    times = protocol.instant_s + STEP_S * np.arange(count)
    return Scenario(
        name=f"{kind}-{seed}",
        kind=kind,
        seed=seed,
        layout=layout,
        instant_s=protocol.instant_s,
        lane_m=way.road.at(stations, way.lane_left_m)[:, :2],
        times_s=times,
        true_poses=reference_poses(track_function(layout.ego.track)(times)),
        actors=tuple(box.id for box in played.actors),
    )


def main() -> int:
    """Draw the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--picture", type=Path, required=True, metavar="FILE")
    parser.add_argument("--set", choices=("development", "test"), default="development")
    args = parser.parse_args()
    protocol = read_protocol()
    groups = protocol.development if args.set == "development" else protocol.test
    shown = [draw_scenario(group.kind, seed) for group in groups for seed in group.seeds[:_EACH]]
    write_png(args.picture, draw_grid(shown, protocol.horizon_s, _EACH))
    print(f"{len(shown)} scenarios: {args.picture}")
    return 0
