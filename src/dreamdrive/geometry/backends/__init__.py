"""Ways of getting geometry, one each; only the table in ``geometry`` imports them."""
