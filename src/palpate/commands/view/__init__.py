"""Watch runs in the browser."""
