"""Houses, plants and furniture beside the roads."""
