"""Ground and markings of edition 2."""
