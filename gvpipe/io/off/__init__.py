"""OFF frames."""
