"""``dreamdrive evaluate consistency``: whether a video keeps to its path and shows one and the same world."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.tables import check_files, fixed, print_table, write_json
from dreamdrive.files.given import CLIP, check_given, check_there

if TYPE_CHECKING:
    from dreamdrive.evaluate import Consistency


def consistency(
    video: Annotated[Positional[Path], arg(metavar="VIDEO")],
    *,
    trajectory: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    intrinsics: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    hfov: Annotated[float | None, arg(metavar="DEG", help_behavior_hint="")] = None,
    fps: Annotated[float | None, arg(metavar="F", help_behavior_hint="")] = None,
    json: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
) -> None:
    """Measure how precisely a video follows a path and how well its frames agree.

    Args:
        video: A video or a folder of images; frames wider than 480 pixels are scaled down to that.
        trajectory: The path that the video was asked to follow, one pose a frame: JSON or TUM.
        intrinsics: Calibration of the camera as JSON, for the size of the video.
        hfov: Horizontal field of view, where there is no calibration; it counts as known.
        fps: Rate of the frames, where the video does not tell it rightly.
        json: Write the figures to this file as well.
    """
    check_files(json=json)
    check_there(video, CLIP)
    check_given(trajectory=trajectory, intrinsics=intrinsics)
    from dreamdrive.data import read_clip, read_trajectory
    from dreamdrive.evaluate import evaluate_consistency

    asked = None if trajectory is None else read_trajectory(trajectory)
    clip = read_clip(video, fps=fps, intrinsics=intrinsics, hfov_deg=hfov)
    known = clip.known.focal
    console = plain()
    with console.status("looking for the path and following the pixels"):
        figures = evaluate_consistency(
            clip.frames, clip.times_s, clip.rig[0], asked, calibrated=known, valid=clip.valid
        )
    title = f"{figures.frames} frames, {figures.width_px} px wide"
    print_table(console, title, ("figure", "value", "unit"), _rows(figures))
    for note in figures.notes:
        console.print(note)
    if json is not None:
        write_json(json, figures)
        console.print(f"{json}")


def _rows(figures: "Consistency") -> list[tuple[str, str, str]]:
    """The figures with their units, one a row; a dash for what was not measured."""
    rows: list[tuple[str, str, str]] = []
    path = figures.path
    rows.append(("path: distance (ATE)", fixed(path and path.ate_percent, 2), "% of the path"))
    rows.append(("path: translation (RPE)", fixed(path and path.translation_percent, 2), "% of a stretch"))
    rows.append(("path: rotation (RPE)", fixed(path and path.rotation_deg_per_m, 4), "deg/m"))
    for at in figures.gaps:
        share = at.epipolar and at.epipolar.share
        within = f"% of {at.epipolar.matches} matches" if at.epipolar else "% of matches"
        rows.append((f"epipolar within 2 px, {at.gap} apart", fixed(share, 1, 100), within))
    for at in figures.gaps:
        level = at.warp and at.warp.grey_levels
        on = f"grey levels on {100 * at.warp.share:.0f} % of pixels" if at.warp else "grey levels"
        rows.append((f"warp error, {at.gap} apart", fixed(level, 2), on))
    return rows
