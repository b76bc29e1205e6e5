"""DUSt3R (Wang et al., CVPR 2024): pointmaps of pairs of images, and one world from all of them.

Written from the architecture as published; the weights are a file that the user has. Those of the authors
are for research only (CC BY-NC-SA 4.0, and the terms of the data they were trained with).
"""

from dreamdrive.geometry.backends.dust3r.pairs import PairMaps, make_pairs
from dreamdrive.geometry.backends.dust3r.reconstruct import reconstruct
from dreamdrive.geometry.protocol import GeometryBackend

DUST3R = GeometryBackend(
    name="dust3r",
    reconstruct=reconstruct,
    about="pointmaps of pairs of frames (DUSt3R), aligned",
    licence="weights CC BY-NC-SA 4.0 and the terms of the data they were trained with: research only",
    memory=(
        "2.3 GB of weights (512 models); with them, at 512x288, 7 GB for 24 frames and never more than 8 GB, "
        "for which long clips get fewer pairs"
    ),
    weights="a model of DUSt3R, such as naver/DUSt3R_ViTLarge_BaseDecoder_512_dpt or its .pth",
)
