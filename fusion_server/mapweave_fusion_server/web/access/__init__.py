"""Who may look at the page, and who may order something on it."""
