"""What shells complete of the command line: a description of it, and one script for each shell.

The scripts hold all words themselves: to start palpate at every Tab would take a third of a second.
"""
