"""Emulated devices for anybody's software."""
