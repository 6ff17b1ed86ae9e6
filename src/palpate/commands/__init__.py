"""What people start: each command is one function over the experiments that there are."""
