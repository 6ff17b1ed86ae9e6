"""Compiles everything at once that is otherwise compiled at its first use."""
