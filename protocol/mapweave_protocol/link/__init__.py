"""Sessions, and what comes and goes over them."""
