"""What every method with a network needs: its table entry, weights from files and from the hub."""
