"""Structure from motion and its gate, focal length, odometry, known poses, checks of paths."""
