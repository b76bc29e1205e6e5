"""All drawing: videos, panels, pictures of the geometry, renderings of drives."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.show.actor_tiles import draw_actors as draw_actors
    from dreamdrive.show.drives import draw_drives as draw_drives
    from dreamdrive.show.geometry import draw_geometry as draw_geometry
    from dreamdrive.show.layout import draw_layout as draw_layout
    from dreamdrive.show.log import draw_log as draw_log
    from dreamdrive.show.look import draw_look as draw_look
    from dreamdrive.show.notebook import card as card, small_picture as small_picture
    from dreamdrive.show.panels import (
        Image as Image,
        depth_colours as depth_colours,
        grid as grid,
        labelled as labelled,
        score_colours as score_colours,
        trust_colours as trust_colours,
    )
    from dreamdrive.show.rendering import (
        RenderOptions as RenderOptions,
        frames as frames,
        places as places,
        video_rate as video_rate,
        view_camera as view_camera,
        write_drive as write_drive,
    )
    from dreamdrive.show.videos import (
        Scored as Scored,
        drive_frames as drive_frames,
        lens_of as lens_of,
        score_image as score_image,
        write_held_out as write_held_out,
        write_png as write_png,
        write_videos as write_videos,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
