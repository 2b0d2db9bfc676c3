"""What people and programs say of a map beside what was seen: marks and orders."""
