"""All drawing: videos, panels, pictures of the geometry, renderings of drives."""

from dreamdrive.show.drives import draw_drives
from dreamdrive.show.geometry import draw_geometry
from dreamdrive.show.geometry_truth import draw_geometry_errors
from dreamdrive.show.log import draw_log
from dreamdrive.show.look import draw_look
from dreamdrive.show.planned import Planned, write_planned
from dreamdrive.show.rendering import RenderOptions, check_size, places, video_rate, write_drive
from dreamdrive.show.videos import Scored, lens_of, write_held_out, write_png, write_videos
