"""Compiling once what would otherwise be compiled when it is first needed."""
