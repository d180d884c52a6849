"""Reports of a graded class for people, learning platforms and CI."""
