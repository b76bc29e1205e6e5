"""What a user asks a prior for: an input and how to read it, what the car shall do, the limits of both."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.scene.control.action import (
        AT_S as AT_S,
        RANGES as RANGES,
        Action as Action,
        Command as Command,
        Direction as Direction,
        Four as Four,
        Goal as Goal,
        Steering as Steering,
        Waypoints as Waypoints,
        check_action as check_action,
    )
    from dreamdrive.scene.control.control import FILES as FILES, Control as Control
    from dreamdrive.scene.control.kinds import (
        DataSetDrive as DataSetDrive,
        Driving as Driving,
        Frames as Frames,
        Optics as Optics,
        PhotoInput as PhotoInput,
        RecordingInput as RecordingInput,
        StreetInput as StreetInput,
        VideoModelInput as VideoModelInput,
        fields_of as fields_of,
        flag_of as flag_of,
    )
    from dreamdrive.scene.control.limits import (
        MAX_PIXELS as MAX_PIXELS,
        MAX_SIDE_PX as MAX_SIDE_PX,
        MIN_SIDE_PX as MIN_SIDE_PX,
        RATES_HZ as RATES_HZ,
        check_largest as check_largest,
        check_numbers as check_numbers,
        check_render_size as check_render_size,
        check_video_size as check_video_size,
        is_too_large as is_too_large,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
