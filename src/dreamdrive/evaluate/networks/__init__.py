"""Networks whose features figures are made of; weights are files that the user has."""
