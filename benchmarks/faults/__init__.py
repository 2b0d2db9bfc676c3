"""What a team comes to when links and processes fail."""
