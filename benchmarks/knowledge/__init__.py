"""Parts of the benchmark of the street network."""
