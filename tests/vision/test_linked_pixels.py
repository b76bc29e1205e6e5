import numpy as np

from dreamdrive.vision.linked_pixels import linked_pixels


def test_pixels_are_linked_by_place_and_by_ratio_of_depth():
    chain = [[0, 0, 10], [3, 0, 10.4], [6, 3, 10.8]]
    apart = [[30, 0, 10], [31, 0, 20], [0, 9, 10]]
    labels = linked_pixels(np.array([*chain, *apart], dtype=np.float64), 3.0, 0.05)
    np.testing.assert_array_equal(labels, [0, 0, 0, 1, 2, 3])
