"""A team's certificate authority, and the keys it gives out."""
