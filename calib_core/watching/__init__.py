"""What has moved since a baseline, seen in still images, in still returns and in traffic: values only, no files and no words."""
