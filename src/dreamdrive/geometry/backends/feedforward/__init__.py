"""Networks that see many frames at once and give cameras and depth of all of them (2025).

Each is other people's code, installed by who wants it, and weights that lie on this machine; here are the few
lines that show it a clip and take its answer. What they have in common is in ``reconstruct``.
"""
