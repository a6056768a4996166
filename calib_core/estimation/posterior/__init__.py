"""The posterior of the pose beyond one peak: samples, other poses, and the pairs it depends on."""
