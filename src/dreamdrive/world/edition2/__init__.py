"""Edition 2 of the drawn street: many surfaces, lights and weathers."""

from dreamdrive.world.edition2.photograph import photograph
from dreamdrive.world.edition2.textures import Texture, TextureKind, TextureLibrary
