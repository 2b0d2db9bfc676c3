"""What a person orders by hand: how orders are made, delivered and taken back."""
