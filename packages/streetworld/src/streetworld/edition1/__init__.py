"""The first edition of drawn streets."""
