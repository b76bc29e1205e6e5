"""Tests, and the runtime type checker they run the package under."""

import jaxtyping

from tests.checking import checked as checked, jaxtyped

# What the import hook puts on every function and dataclass.
jaxtyping.jaxtyped = jaxtyped  # pyright: ignore[reportAttributeAccessIssue]
