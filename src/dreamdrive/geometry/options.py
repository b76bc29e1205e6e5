"""Options of the geometry."""

from dataclasses import dataclass, field
from pathlib import Path

from dreamdrive.errors import InputError


@dataclass(frozen=True)
class GateOptions:
    """When a sparse reconstruction of a drive is believed.

    Lengths in pixels are of the picture that features are found in, 480 to 640 wide.

    Attributes:
        registered: Share of the frames that have to be placed.
        least_points: Points that have to be there.
        least_seen: Points that the poorest frame has to see.
        points: Points from which on there are enough; with fewer more are looked for.
        points_a_frame: Points a frame that are enough as well, where these are fewer.
        seen: Points in the poorest frame that are enough.
        little: Part of these numbers that is enough where traffic leaves little of the picture.
        wobbling_px: Mean reprojection error above which frames are not quite pictures of one street.
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
    """How the plane sweep finds depth; what it is worth: docs/results/ablation.md.

    Attributes:
        reach_frames: Sources are at most so many frames away.
        flanks: Whether the sides of things are filled down to the road.
        dense: Share of pixels with given depth from which on it is all there is: lidar's is not.
    """

    reach_frames: int = 5
    flanks: bool = True
    dense: float = 0.25


@dataclass(frozen=True)
class FusionOptions:
    """Who is believed where stereo, the road and the street network all say something of a pixel's depth.

    Spreads are relative standard deviations of the depth. What it is worth: docs/results/ablation.md.

    Attributes:
        sure: Confidence from which swept depth counts, and the network is aligned to it.
        hinted: Confidence from which it counts where it is near the aligned depth.
        sure_spreads: Spreads of the aligned depth beyond which even sure stereo is not believed.
        hinted_spreads: Spreads within which hinted stereo is.
        reach: Part of the image width over which the network's scale is carried from sure pixels.
        far_m: Aligned depth from which sure stereo is believed that it is farther still.
        stereo_spread: Of stereo that is believed, and of the road.
        least_spread: Of the network, at least.
        contact_spread: Of the depth by a road user's contact with the road, beside that of the row.
        thin_spread: Of people and two-wheelers, at least: a row is a tenth of their distance, and masks of
            what is so small are off by as much.
        end_overhang: How much nearer front and rear are than their contact with the road, over the height.
        side_overhang: The same of the sides.
        user_stereo: Log depth by which sure stereo on a standing road user may differ from its contact.
        user_reach: Part of the image width over which the pixels between follow such stereo.
        user_spread: Of such stereo.
        preferred: By how much swept depth has to correlate better with neighbours to be taken against all.
        preferred_within: Log depth by which it may differ then: farther off, both may be wrong.
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
    thin_spread: float = 0.2
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
    """When pixels count as moving; what it is worth: docs/results/ablation.md.

    Attributes:
        excess_px: Flow beyond what a static point may show that is a vote, if it explains the pixel better.
        gain_levels: Grey levels by which it has to.
        sure_excess_px: The same for a sure pixel, of which a region needs some.
        sure_gain_levels: The same.
        off_line: Whether flow beside the epipolar line counts as well.
        vote: Mean of the votes of a frame and its neighbours from which a pixel is in a region.
        least_area: Smaller regions are noise, as a share of the picture.
        oncoming: Whether oncoming traffic is looked for where it does not stand on the road.
        rounds: How often regions are completed to outlines of whole things.
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
class RoadUserOptions:
    """Which of the road users that the street network sees move; its worth: docs/results/ablation.md.

    Attributes:
        sure: Trust in a class from which on a pixel is believed to be no road user.
        moving_share: Part of its pixels, flagged or against contact with the road, from which on one moves.
        nearer: Log of the ratio of distances from which on stereo contradicts contact with the road.
        sure_stereo: Trust in stereo from which on it contradicts.
        doubtful_share: Part that is enough if the distances of the road user belong to no one place.
        off_place: Median log of their ratio to those of the best place from which on they do not.
        rim: Flagged rims up to twice this share of the width do not move: a road user has just left them.
        alike: Least share of its colours with which a road user goes on: the next car is not the same.
        leap: Log of the ratio of distances from frame to frame up to which it goes on as the same.
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
    users: RoadUserOptions = field(default_factory=RoadUserOptions)

    def __post_init__(self) -> None:
        height_m = self.camera_height_m
        if height_m is not None and not 0 < height_m < float("inf"):
            raise InputError(f"--camera-height {height_m:g}: expected metres above the road, such as 1.5")
