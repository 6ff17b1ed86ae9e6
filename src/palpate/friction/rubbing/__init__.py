"""What strokes and twists on a surface tell: mu, e, how they grow, and with what right."""
