"""All that is measured on a GPU in one call, part by part: ``gpu --all``."""
