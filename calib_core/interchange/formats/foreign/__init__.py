"""Files of other calibration and labelling tools and of data sets, each in the shape that the tool writes."""
