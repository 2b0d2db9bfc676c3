"""Shape whatever its position (paper, VIII-A, B)."""
