"""What is compared: whose maps are here, and what is known of them."""
