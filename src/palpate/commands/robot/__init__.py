"""Robot files, shown and checked."""
