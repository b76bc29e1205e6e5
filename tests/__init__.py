"""Tests, and the runtime type checker they run the package under."""

from beartype import BeartypeConf, beartype

# An int is a float, as PEP 484 and the static checker have it.
checked = beartype(conf=BeartypeConf(is_pep484_tower=True))
