"""The colours of ImageNet, by which pictures are normalised."""

MEAN, SPREAD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
