"""How leaves and spring are cut, and what stands around them."""
