"""What experiments share; knows none of them."""
