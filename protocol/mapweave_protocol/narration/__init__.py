"""What happens, told to a person."""
