"""Feed logs through sensing and control again."""
