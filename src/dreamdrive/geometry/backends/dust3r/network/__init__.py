"""The network: weights from a file, frames to pictures, pictures to pointmaps of pairs."""
