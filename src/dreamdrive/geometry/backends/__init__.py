"""Ways of getting geometry, one each; only ``choices.BACKENDS`` names them."""
