"""What one scan says."""
