"""What carries a fingertip: stages and arms, and how they are driven."""
