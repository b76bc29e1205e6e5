"""The road plane, the metric scale, and what stands on the road."""
