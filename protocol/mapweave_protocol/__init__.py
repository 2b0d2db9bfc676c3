"""What travels between the processes of a mapweave team."""
