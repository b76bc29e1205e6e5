"""The small street network: what a picture shows, without any geometry."""
