"""One module a file format, which states its conventions; calibration, poses, geometry and truth read it.

All raise ``InputError`` where a file is damaged or of another form, calling it as ``where`` or ``option``
say.
"""
