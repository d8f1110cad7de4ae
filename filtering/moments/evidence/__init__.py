"""What counterparts and pictures say against each demonstration."""
