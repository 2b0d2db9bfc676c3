"""A team of many robots on a virtual clock."""
