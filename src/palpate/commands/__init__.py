"""The commands of the command line; each is one function that works for every experiment."""
