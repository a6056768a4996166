"""ROS: static transforms as a command and as launch files, and URDF."""
