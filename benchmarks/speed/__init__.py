"""How much processor time each stage takes, beside what a user would take instead."""
