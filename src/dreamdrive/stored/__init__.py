"""The scene folder on disk: all that ``scene`` and ``motion`` hold, checked before it is believed."""

from dreamdrive.stored.folder import load_scene, save_scene
