"""Streets: layouts, logs, the truth of drawn drives, and what is seen of them."""
