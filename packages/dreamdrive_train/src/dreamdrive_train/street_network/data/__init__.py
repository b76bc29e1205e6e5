"""Records: pictures with what is known of them, made, read, mixed and changed."""
