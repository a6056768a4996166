"""Files that hold messages: ROS 1 bags, MCAP, SQLite; read by position, recovered where damaged, and written."""
