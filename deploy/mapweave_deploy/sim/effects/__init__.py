"""What makes a lidar see other than walls: glass, mirrors, doors, the floor."""
