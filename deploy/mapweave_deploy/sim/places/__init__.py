"""Places built for what is hard in them."""
