"""A mesh sequence, and what is made of one without coding it."""
