"""The sections of the report, one file each: a value in, HTML out."""
