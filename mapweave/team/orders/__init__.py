"""What people have said of a map, carried into the joint one."""
