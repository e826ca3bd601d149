"""From a contrast CT to the labels of the heart's chambers and great vessels."""

from cathxr.heart.segmentation.pipeline import Segmentation, segment

__all__ = ["Segmentation", "segment"]
