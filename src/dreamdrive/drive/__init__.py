"""New drives and how they are shown."""

from dreamdrive.drive.manoeuvres import MANOEUVRES, manoeuvre, resampled

__all__ = ["MANOEUVRES", "manoeuvre", "resampled"]
