"""One module a file format, which states its conventions; calibration, poses, geometry and truth read it."""
