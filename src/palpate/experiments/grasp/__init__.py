"""Hold an object that is pulled at."""
