"""What people start: configuration in, result out."""
