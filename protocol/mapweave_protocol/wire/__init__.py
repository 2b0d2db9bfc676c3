"""What travels: keys, messages and their bytes."""
