"""What an agent does while its robot drives: scans as they come, and where the robot is."""
