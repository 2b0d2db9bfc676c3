"""What ``make`` runs that is more than a line."""
