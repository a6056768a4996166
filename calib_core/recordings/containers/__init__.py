"""Message containers (ROS 1 bags, MCAP, SQLite): positioned reading, recovery of damaged files, and writing."""
