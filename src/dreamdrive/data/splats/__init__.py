"""Files of 3D Gaussians: PLY, SPZ and glTF, read into Gaussians and written from them, a module a format.

All readers take bytes and raise ``InputError`` where they are damaged or of another form, calling them as
``where`` says. Nothing is allocated for what the bytes only claim to hold.
"""
