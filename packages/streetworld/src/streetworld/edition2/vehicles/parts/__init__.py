"""Parts of vehicles."""
