"""What comparing two maps takes (paper, VIII)."""
