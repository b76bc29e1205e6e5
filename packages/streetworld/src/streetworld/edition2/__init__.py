"""The second edition of drawn streets: far more various than the first, on hills, in every weather."""
