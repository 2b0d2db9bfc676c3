"""What is said by hand: a robot's marks, operators' orders that it keeps, maps that are sent."""
