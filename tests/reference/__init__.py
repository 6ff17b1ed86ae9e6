"""References in high precision that the tests measure the library against."""
