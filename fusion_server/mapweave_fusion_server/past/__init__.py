"""What a store remembers, for a person: commands that read the file itself."""
