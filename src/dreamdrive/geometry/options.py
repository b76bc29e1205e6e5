"""What can be chosen of the geometry."""

from dataclasses import dataclass, field
from pathlib import Path

from dreamdrive.errors import InputError


@dataclass(frozen=True)
class GateOptions:
    """When a sparse reconstruction of a drive is believed.

    Lengths in pixels are of the picture that features are found in, 480 to 640 wide.

    Attributes:
        registered: Share of the frames that have to be placed.
        least_points: Points that have to be there, and ...
        least_seen: ... in the poorest frame.
        points: Points from which on there are enough, else more are looked for ...
        points_a_frame: ... or so many for each frame, if these are fewer ...
        seen: ... or else so many in the poorest frame.
        little: Part of these numbers that is enough, of both, where traffic leaves little of the picture.
        wobbling_px: Mean reprojection error above which frames are not quite pictures of one street, as
            generated ones are not: recorded drives stay below 0.4.
        reprojection_px: Mean reprojection error above which the model is refused.
        forward: Least cosine between a step and the usual direction of the drive, as the camera sees both.
        variation: Standard deviation of the lengths of the steps about their trend, over their mean.
    """

    registered: float = 0.9
    least_points: int = 100
    least_seen: int = 8
    points: int = 600
    points_a_frame: int = 25
    seen: int = 60
    little: float = 0.5
    wobbling_px: float = 0.5
    reprojection_px: float = 1.0
    forward: float = 0.9
    variation: float = 0.6


@dataclass(frozen=True)
class DepthOptions:
    """How the plane sweep finds depth.

    Attributes:
        reach_frames: Sources are at most so many frames away.
        flanks: Whether the sides of things are filled down to the road. Without it held-out frames lose
            0.38 dB (``benchmarks/results/parts-2026-11-23.md``).
    """

    reach_frames: int = 5
    flanks: bool = True


@dataclass(frozen=True)
class FusionOptions:
    """Who is believed where stereo, the road and the street network all say something of a pixel's depth.

    Spreads are relative standard deviations of the depth.

    Attributes:
        sure: Confidence from which swept depth counts, and the network is aligned to it.
        hinted: Confidence from which it counts where it is near the aligned depth.
        sure_spreads: Spreads of the aligned depth beyond which even sure stereo is not believed.
        hinted_spreads: Spreads within which hinted stereo is.
        far_m: Aligned depth from which sure stereo is believed that it is farther still. On held-out frames
            of PandaSet 0.18 dB.
        reach: Part of the image width over which the network's scale is carried from sure pixels.
        stereo_spread: Of stereo that is believed, and of the road.
        least_spread: Of the network, at least.
        contact_spread: Of the depth of a road user that its contact with the road gives, beside that of the
            row in which it is seen.
        end_overhang: By how much front and rear of a vehicle are nearer than their line of contact with the
            road, in shares of the vehicle's height. Of the points on PandaSet's vehicles 25 % are more than
            10 % off with 0, 15 % with 0.25, 16 % with 0.33 and 20 % with 0.45; of standing vehicles on drawn
            streets 1-3 it is 36, 17, 17 and 18 %.
        side_overhang: The same of its sides.
        user_stereo: Log depth by which sure stereo on a standing road user may differ from its contact.
        user_reach: Part of the image width over which the pixels between follow it: without it standing cars
            are more than 10 % off in 0.125 of their pixels on drawn streets 0-3, with it in 0.109.
        user_spread: Of such stereo.
        preferred: By how much the correlation with neighbours has to be better at the swept depth, for it to
            be taken against all others. Held-out frames of PandaSet win 0.15 dB.
        preferred_within: Log depth by which it may differ then: farther off, both may be wrong. With no limit
            the mean error of lidar points on PandaSet grows from 0.076 to 0.083, with 0.3 it stays.
        supported: Confidence from which on it may be.
    """

    sure: float = 0.5
    hinted: float = 0.15
    sure_spreads: float = 4.0
    hinted_spreads: float = 1.5
    reach: float = 0.05
    far_m: float = 30.0
    stereo_spread: float = 0.013
    least_spread: float = 0.05
    contact_spread: float = 0.06
    end_overhang: float = 0.3
    side_overhang: float = 0.1
    user_stereo: float = 0.12
    user_reach: float = 0.01
    user_spread: float = 0.05
    preferred: float = 0.1
    preferred_within: float = 0.3
    supported: float = 0.4


@dataclass(frozen=True)
class MovingOptions:
    """When pixels count as moving.

    Figures are what the IoU of the evidence loses without the part, in ``benchmarks/results/parts-*.md``.

    Attributes:
        excess_px: Flow beyond what a static point may show ...
        gain_levels: ... which explains the pixel better by so many grey levels, for a vote ...
        sure_excess_px: ... and the same for a sure pixel,
        sure_gain_levels: of which a region needs some.
        off_line: Whether flow beside the epipolar line counts as well: 0.022.
        vote: Mean of the votes of a frame and its neighbours from which a pixel is in a region.
        least_area: Smaller regions are noise, as a share of the picture.
        oncoming: Whether oncoming traffic is looked for where it does not stand on the road: 0.044.
        rounds: How often regions are completed to outlines of whole things: 0.164 for none, 0.016 for one.
    """

    excess_px: float = 1.0
    gain_levels: float = 2.5
    sure_excess_px: float = 3.0
    sure_gain_levels: float = 5.0
    off_line: bool = True
    vote: float = 0.45
    least_area: float = 0.0006
    oncoming: bool = True
    rounds: int = 2


@dataclass(frozen=True)
class UserOptions:
    """Which of the road users that the street network sees move.

    Attributes:
        sure: Trust in a class from which on a pixel is believed to be no road user.
        moving_share: Part of a road user's pixels, over all its frames, that are flagged or contradict
            contact with the road, from which on it moves.
        nearer: Log of the ratio of distances from which on stereo contradicts contact with the road. Parked
            cars come to 0.3, oncoming ones to 0.6 to 1.3.
        sure_stereo: Trust in stereo from which on it contradicts.
        doubtful_share: Such a part is enough if the distances of the road user belong to no one place ...
        off_place: ... which they do from this median logarithm of the ratio between them and those of the
            best place. A grey truck that keeps beside the camera on one of sixteen drawn streets shows little
            flow: 0.27 of it is flagged, and its distances are off by 0.56.
        rim: Regions beside road users that are flagged, and nowhere wider than twice this share of the width,
            do not move: four fifths of their pixels are street that a user has just left. With 0 standing
            things of drawn streets 0-7 seem to move 15 mm in place of 13, and KITTI 04 loses 0.4 dB.
        alike: A road user does not go on as one that has less of its colours than this share. On drawn
            streets 0-15 the same one has 0.48 to 1 of them from frame to frame, but for once in 1,700 times;
            without it a car that has left the picture goes on as the next one on streets 2, 3, 9 and 13, and
            what moves on 9, seen 2 m aside, loses 1.4 dB.
        leap: Nor as one whose distance from one frame to the next is larger by this logarithm of their ratio:
            on a village street one parked car after another was one that moves.
    """

    sure: float = 0.8
    moving_share: float = 0.3
    nearer: float = 0.45
    sure_stereo: float = 0.25
    doubtful_share: float = 0.2
    off_place: float = 0.25
    rim: float = 0.02
    alike: float = 0.45
    leap: float = 0.5


@dataclass(frozen=True)
class GeometryOptions:
    """How cameras and depth are found.

    Attributes:
        method: Name of the way.
        weights: The network's file or folder, for methods that have one.
        camera_height_m: Height of the camera above the road, which fixes the metric scale where nothing
            better does; None assumes 1.5 m.
        refine_poses: Whether known poses give the length of the path only, see ``cameras.refine``.
        gate: When structure from motion is believed.
        depth: How the plane sweep finds depth.
        moving: When pixels count as moving.
        fusion: What is believed where the street network speaks, too.
        users: Which of the road users that it sees move.
    """

    method: str = "classical"
    weights: Path | None = None
    camera_height_m: float | None = None
    refine_poses: bool = False
    gate: GateOptions = field(default_factory=GateOptions)
    depth: DepthOptions = field(default_factory=DepthOptions)
    moving: MovingOptions = field(default_factory=MovingOptions)
    fusion: FusionOptions = field(default_factory=FusionOptions)
    users: UserOptions = field(default_factory=UserOptions)

    def __post_init__(self) -> None:
        height_m = self.camera_height_m
        if height_m is not None and not 0 < height_m < float("inf"):
            raise InputError(f"--camera-height {height_m:g}: expected metres above the road, such as 1.5")
