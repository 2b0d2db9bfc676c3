"""What keeps a receiver whole: what it refuses, whom it remembers, whose turn it is."""
