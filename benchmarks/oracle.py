"""What truth in place of each part is worth: labels, tracks, depth of what moves, depth of what stands.

    python benchmarks/oracle.py [--seeds SEED ...] [--references clean corrupted] [--poses true estimated]
                                [--views shift_2 ...] [--arms none labels+tracks ...] [--runs DIR]
                                [--json FILE] [--markdown FILE]

The same fit each time (drawn streets of edition 1, 320x192, ``draft``, the twin of the street network), with
the truth of the drawing in place of what stages found. ``as it is`` has none, ``none`` not even the street
network. ``standard`` has none either, and the steps of that quality; ``longer`` takes five times as many, to
see whether steps undo what was right. ``ceiling`` has no scene: it reads each pixel that a training frame has
seen from the one that saw it at the most similar distance, with true depth and tracks.
PSNR of all pixels, of seen ones that stand and that move, and of unseen ones; then how well what moves is
told apart, and where the boxes of actors are. What was measured with the same program is kept.
"""

import sys

from oracle.main import main

if __name__ == "__main__":
    sys.exit(main(__doc__))
