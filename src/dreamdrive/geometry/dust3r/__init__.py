"""DUSt3R (Wang et al. 2024): two images in, the points of both in the frame of the first out.

Written from the architecture as published; the weights are a file that the user has. Those of the authors
are for research only (CC BY-NC-SA 4.0, and the terms of the data they were trained with).
"""

from dreamdrive.geometry.dust3r.reconstruct import reconstruct

__all__ = ["reconstruct"]
