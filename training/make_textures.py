"""Cut the textures of drawn streets: python training/make_textures.py TRAINING_PICTURES OUT."""

import sys
from pathlib import Path

from dreamdrive_train.street_network.data.textures import make_textures

if __name__ == "__main__":
    data, out = (Path(argument) for argument in sys.argv[1:3])
    sys.stdout.write(
        f"{len(make_textures(Path(__file__).with_name('texture_cuts.json'), data, out))} textures in {out}\n"
    )
