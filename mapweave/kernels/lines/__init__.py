"""What merging and simplifying lines takes (paper, VI and VII)."""
