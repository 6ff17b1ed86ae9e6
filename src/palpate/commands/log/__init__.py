"""Contents of logs, and logs as data sets."""
