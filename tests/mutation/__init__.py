"""Readers against mutated files: whatever a file holds, a reader gives its noun or refuses with its error.

``readers.READERS`` lists the readers, each with a small sample that is valid; ``mutators`` spoil a file of
it; ``runner`` reads the spoilt sample in a process of its own, within limits of time and memory.

    python -m tests.mutation --cases 100000 --workers 2 --seed 0
    python -m tests.mutation --reader poses-tum --case 17
"""
