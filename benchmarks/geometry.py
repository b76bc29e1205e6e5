"""Which geometry is how good, and what DUSt3R's alignment costs.

    python benchmarks/geometry.py [--quick] [--resume] [--runs runs/geometry] [--only PATTERN ...]
                                  [--json FILE] [--markdown FILE] [--plot FILE.png]

1. The ways of getting geometry that need no weights, on recorded clips and drawn streets of which cameras and
   depth are known.
2. DUSt3R's alignment of pointmaps that are made from drawn streets: the true points of each pair, with depth
   5 % off in patches of an eighth of the width, a scale 10 % off, a focal length 5 % off, a tenth of gross
   outliers, all drawn anew for each pair, and moving cars where they are at each frame. Beside it what the
   authors' program makes of the same pairs: its initialisation with its defects, its loss, 300 steps of Adam,
   a focal length for each image.
3. Seconds of both to the same loss.
4. Which pairs of frames are worth their time.

At last memory and seconds against the number of frames, and a recorded clip through ``dreamdrive generate``
with the true cameras and without. Seconds are those of the processor, so that they depend little on what else
the machine does: an alignment has one thread, the two of a way of getting geometry are added up. Each
measurement is a file below ``--runs`` with its date, commit and machine; with ``--resume`` those that are
there count, if they are of the same case and did not fail. How long each part takes is in the README.
"""

import os
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before torch is imported

from geometry.main import main

if __name__ == "__main__":
    sys.exit(main(__doc__))
