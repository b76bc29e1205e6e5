"""Cross-View Transformers."""
