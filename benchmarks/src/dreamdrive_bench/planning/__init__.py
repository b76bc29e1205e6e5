"""Parts of the planning experiment."""
