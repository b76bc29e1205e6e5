"""What is known of recorded clips: paths, labelled boxes, lidar points."""
