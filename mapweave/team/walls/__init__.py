"""The walls of a joint map: merged, and how sure each of them is."""
