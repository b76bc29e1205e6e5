"""What each part of hybrid is worth, on drawn streets with a truth.

    python benchmarks/ablation.py [--seeds S ...] [--variants NAME ...] [--workers N] [--resume]
                                  [--runs runs/street] [--json FILE] [--markdown FILE]

Variants of hybrid with true poses, from corrupted and from clean references: each leaves one part out, or
takes another choice in its place, such as the paper's. All begin with the static fit of ``street.py``, except
those that vary it, and use what that has prepared in the same ``--runs``.
"""

import sys

from ablation.main import main

if __name__ == "__main__":
    sys.exit(main(__doc__))
