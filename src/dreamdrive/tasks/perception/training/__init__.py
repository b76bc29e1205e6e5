"""Training and scoring of Cross-View Transformers."""
