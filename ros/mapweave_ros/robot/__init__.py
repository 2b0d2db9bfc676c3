"""What is known of the robot beside one scan: its frames, its odometry."""
