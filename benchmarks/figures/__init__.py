"""The figures that README and documents quote: measured, kept, written where they are read."""
