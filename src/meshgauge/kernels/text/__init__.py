"""Numbers in text, and lists of lists of them."""
