"""New drives and how they are shown."""

from dreamdrive.drive.drives import RATES_HZ, Drive, check_numbers, drives_of
from dreamdrive.drive.manoeuvres import MANOEUVRES, frame_rate, manoeuvre, resampled, smooth, up_of
