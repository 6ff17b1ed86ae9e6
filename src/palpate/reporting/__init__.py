"""What a run tells its reader: a self-contained HTML report, and tables for the terminal."""
